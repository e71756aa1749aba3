#include "client/viewer/page_command.h"

#include "common/text.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <map>

namespace crumple::viewer {
namespace {

Result<Vec3> vector_of(const nlohmann::json& message, const char* field) {
  const auto at = message.find(field);
  if (at == message.end() || !at->is_array() || at->size() != 3) return invalid(field, "must be three numbers");
  Vec3 v;
  for (int k = 0; k < 3; ++k) {
    if (!(*at)[k].is_number()) return invalid(field, "must be three numbers");
    v[k] = (*at)[k].get<double>();
  }
  if (!v.allFinite()) return invalid(field, "must be finite");
  return v;
}

Result<std::uint32_t> whole_number_of(const nlohmann::json& message, const char* field, std::uint32_t high) {
  const auto at = message.find(field);
  if (at == message.end() || !at->is_number_unsigned() || at->get<std::uint64_t>() > high) {
    return invalid(field, text("must be a whole number up to ", high));
  }
  return at->get<std::uint32_t>();
}

}  // namespace

Result<PageRequest> parse_request(std::string_view json) {
  using Kind = PageRequest::Kind;
  static const std::map<std::string, Kind> kinds{{"credit", Kind::credit}, {"values", Kind::values}, {"play", Kind::play},
                                                 {"pause", Kind::pause},   {"restart", Kind::restart}, {"step", Kind::step},
                                                 {"push", Kind::push}};
  const auto message = nlohmann::json::parse(json, nullptr, false);
  if (!message.is_object()) return invalid("", "a request must be a JSON object");
  const auto type = message.find("type");
  if (type == message.end() || !type->is_string()) return invalid("type", "is missing");
  const auto kind = kinds.find(type->get<std::string>());
  if (kind == kinds.end()) return invalid("type", "is not a request that this viewer knows");

  PageRequest request{.kind = kind->second};
  if (request.kind == Kind::values) {
    const auto on = message.find("on");
    if (on == message.end() || !on->is_boolean()) return invalid("on", "must be true or false");
    request.on = on->get<bool>();
  }
  if (request.kind == Kind::step) {
    auto count = whole_number_of(message, "count", 10'000);
    if (!count) return std::unexpected(count.error());
    request.count = *count;
  }
  if (request.kind == Kind::push) {
    auto body = whole_number_of(message, "body", 1'000'000);
    if (!body) return std::unexpected(body.error());
    auto point = vector_of(message, "point");
    if (!point) return std::unexpected(point.error());
    auto impulse = vector_of(message, "impulse");
    if (!impulse) return std::unexpected(impulse.error());
    request.body = *body;
    request.point = *point;
    request.impulse = *impulse;
  }
  return request;
}

Result<void> perform(const PageRequest& request, ViewedWorld& viewed) {
  client::SimulationClient& client = viewed.client();
  const WorldId world = viewed.id();
  const auto outcome = [](const auto& result) -> Result<void> {
    if (!result) return std::unexpected(result.error());
    return {};
  };
  switch (request.kind) {
    case PageRequest::Kind::credit:
    case PageRequest::Kind::values: return {};
    case PageRequest::Kind::play: return client.play(world);
    case PageRequest::Kind::pause: return outcome(client.pause(world));
    case PageRequest::Kind::restart: return viewed.restart();
    case PageRequest::Kind::step: return outcome(client.step(world, request.count));
    case PageRequest::Kind::push: break;
  }
  auto info = client.world(world, true);
  if (!info) return std::unexpected(info.error());
  if (request.body >= info->bodies.size()) return invalid("body", text("is ", request.body, ", the world has ", info->bodies.size(), " bodies"));
  return outcome(client.apply(world, client::impulse_command(info->bodies[request.body].name, request.impulse, request.point)));
}

}  // namespace crumple::viewer
