#include "client/sdk/message_file.h"

#include <google/protobuf/util/json_util.h>

#include <fstream>
#include <sstream>

#include "crumple/v1/simulation.pb.h"

namespace crumple::client {
namespace {

template <class Message>
Result<Message> read_message(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream json;
  if (!file || !(json << file.rdbuf())) return std::unexpected(Error{ErrorCode::not_found, path, "cannot be read"});
  Message message;
  const auto status = google::protobuf::util::JsonStringToMessage(json.str(), &message);
  if (!status.ok()) return invalid(path, "is not such a message: " + std::string(status.message()));
  return message;
}

}  // namespace

Result<v1::Scene> read_scene_message(const std::string& path) { return read_message<v1::Scene>(path); }

Result<std::vector<v1::ScriptedCommand>> read_script_message(const std::string& path) {
  const auto request = read_message<v1::RunScriptRequest>(path);
  if (!request) return std::unexpected(request.error());
  return std::vector<v1::ScriptedCommand>(request->commands().begin(), request->commands().end());
}

}  // namespace crumple::client
