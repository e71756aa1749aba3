#include "server/io/mesh_file.h"

#include "common/text.h"

#include <algorithm>
#include <fstream>
#include <iterator>

namespace crumple::io {

std::string small_ending(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  for (char& c : ending)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return ending;
}

bool has_ending(const std::filesystem::path& file, std::initializer_list<std::string_view> endings) {
  const std::string ending = small_ending(file);
  return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

Result<void> check_file(const std::filesystem::path& file, std::uintmax_t limit) {
  const std::string name = file.filename().string();
  std::error_code error;
  if (!std::filesystem::exists(file, error))
    return std::unexpected(Error{ErrorCode::not_found, name, "does not exist"});
  if (!std::filesystem::is_regular_file(file, error)) return invalid(name, "is not a file");
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) return invalid(name, text("cannot be read: ", error.message()));
  if (size == 0) return invalid(name, "is empty");
  if (size > limit) return invalid(name, text("has ", size, " bytes, must have at most ", limit));
  return {};
}

Result<std::string> read_whole(const std::filesystem::path& file, std::uintmax_t limit) {
  if (auto readable = check_file(file, limit); !readable) return std::unexpected(readable.error());
  std::ifstream in(file, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(in), {}};
  if (in.bad() || content.empty()) return invalid(file.filename().string(), "cannot be read");
  return content;
}

}  // namespace crumple::io
