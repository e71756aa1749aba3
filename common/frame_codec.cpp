#include "common/frame_codec.h"

#include "common/byte_stream.h"
#include "common/text.h"
#include "common/triangle_codec.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace crumple {

namespace {

constexpr std::uint32_t kNoBase = 0xffffffff;

// ---- writing ----------------------------------------------------------------------------------------------------

void put_text(ByteWriter& out, const std::string& text) {
  out.put(static_cast<std::uint32_t>(text.size()));
  out.append(text.data(), text.size());
  out.pad_to_4();
}

void put_values(ByteWriter& out, const std::vector<float>& values, MessageForm form) {
  for (const float value : values) {
    const float clean = presentable(value);
    if (form.codec == Codec::float32) out.put(clean);
    else out.put(static_cast<std::uint8_t>(std::clamp(clean, 0.0f, 1.0f) * 255 + 0.5f));
  }
  out.pad_to_4();
}

void put_body(ByteWriter& out, const BodyFrame& body, const PositionReference* reference, MessageForm form) {
  assert(reference || body.positions.empty());
  out.put(body.id);
  out.put(static_cast<std::uint32_t>(body.positions.size()));
  out.put(static_cast<std::uint32_t>(body.values.size()));
  for (const double number : body.pose.R_WB.coeffs()) out.put(presentable(number));
  for (const double number : body.pose.p_WB) out.put(presentable(number));
  put_positions(out, body.positions, reference, form);
  put_values(out, body.values, form);
}

void put_body(ByteWriter& out, const BodyTopology& body, MessageForm form) {
  assert(body.channels.size() <= 0xffff);
  out.put(body.id);
  out.put(static_cast<std::uint8_t>(body.model));
  out.put(static_cast<std::uint8_t>(body.deformable));
  out.put(static_cast<std::uint16_t>(body.channels.size()));
  for (const float part : body.colour) out.put(presentable(part));
  out.put(presentable(body.opacity));
  out.put(static_cast<std::uint32_t>(body.vertices.size()));
  out.put(static_cast<std::uint32_t>(body.triangles.size()));
  out.put(body.epoch);
  put_text(out, body.name);
  for (const std::string& channel : body.channels) put_text(out, channel);
  put_positions(out, body.vertices, nullptr, form);
  put_triangles(out, body.triangles, form);
}

// At most, in either codec: the constants stand for fixed fields, boxes, lengths and padding.
constexpr std::uint64_t kMessageFields = 64;
std::uint64_t most_bytes(const BodyTopology& body) {
  std::uint64_t bytes = 96 + body.name.size() + sizeof(Vec3f) * body.vertices.size() + sizeof(Triangle) * body.triangles.size();
  for (const std::string& channel : body.channels) bytes += 8 + channel.size();
  return bytes;
}
std::uint64_t most_frame_bytes(const BodyTopology& body) {
  return 96 + (body.deformable ? (sizeof(Vec3f) + sizeof(float) * body.channels.size()) * body.vertices.size() : 0);
}

// What changed after `since`, in lots that fit one message each; at least one, if an empty one.
std::vector<std::vector<const BodyTopology*>> lots_of(const Topology& topology, std::optional<std::uint32_t> since,
                                                      std::size_t max_content) {
  std::vector<std::vector<const BodyTopology*>> lots(1);
  std::uint64_t bytes = kMessageFields;
  for (const BodyTopology& body : topology.bodies) {
    if (since && body.epoch <= *since) continue;
    if (!lots.back().empty() && bytes + most_bytes(body) > max_content) {
      lots.emplace_back();
      bytes = kMessageFields;
    }
    lots.back().push_back(&body);
    bytes += most_bytes(body);
  }
  return lots;
}

// ---- reading ----------------------------------------------------------------------------------------------------

std::optional<std::string> get_text(ByteReader& in) {
  const auto length = in.get<std::uint32_t>();
  const char* data = in.skip(length);
  if (!data) return {};
  std::string text(data, length);
  in.skip_padding();
  return text;
}

bool get_values(ByteReader& in, std::uint32_t count, MessageForm form, std::vector<float>& values) {
  if (count == 0) return true;
  const std::size_t bytes = form.codec == Codec::float32 ? 4 : 1;
  const char* data = in.skip(std::uint64_t{bytes} * count);
  if (!data) return false;
  values.resize(count);
  if (form.codec == Codec::float32) std::memcpy(values.data(), data, 4 * std::size_t{count});
  else std::transform(data, data + count, values.begin(), [](char c) { return static_cast<std::uint8_t>(c) / 255.0f; });
  in.skip_padding();
  return in.ok() && std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

bool get_body(ByteReader& in, MessageForm form, const FrameReference& reference, BodyFrame& body) {
  body.id = in.get<std::uint32_t>();
  const auto positions = in.get<std::uint32_t>(), values = in.get<std::uint32_t>();
  Eigen::Matrix<double, 7, 1> pose;
  for (double& number : pose) number = in.get<float>();
  body.pose.R_WB.coeffs() = pose.head<4>();  // Eigen's order: x y z w
  body.pose.p_WB = pose.tail<3>();
  const PositionReference* drawn = reference.find(body.id);
  if (!drawn || (positions > 0 && positions != drawn->X.size())) return false;
  return in.ok() && pose.allFinite() && get_positions(in, positions, drawn, form, body.positions) &&
         get_values(in, values, form, body.values);
}

bool get_body(ByteReader& in, MessageForm form, std::uint32_t epoch, BodyTopology& body) {
  body.id = in.get<std::uint32_t>();
  const auto model = in.get<std::uint8_t>(), deformable = in.get<std::uint8_t>();
  const auto channels = in.get<std::uint16_t>();
  for (float& part : body.colour) part = in.get<float>();
  body.opacity = in.get<float>();
  const auto vertices = in.get<std::uint32_t>(), triangles = in.get<std::uint32_t>();
  body.epoch = form.version < 2 ? epoch : in.get<std::uint32_t>();
  if (!in.ok() || model > static_cast<int>(BodyModel::example_based) || deformable > 1 || body.epoch > epoch) return false;
  if (!Eigen::Map<Vec3f>(body.colour.data()).allFinite() || !std::isfinite(body.opacity)) return false;
  body.model = static_cast<BodyModel>(model);
  body.deformable = deformable;

  for (int i = -1; i < channels; ++i) {
    auto text = get_text(in);
    if (!text) return false;
    if (i < 0) body.name = std::move(*text);
    else body.channels.push_back(std::move(*text));
  }
  return get_positions(in, vertices, nullptr, form, body.vertices) && get_triangles(in, triangles, vertices, form, body.triangles);
}

// get(body): false if it is cut short or out of range. A body takes at least `smallest` bytes, so that a false count cannot claim memory.
template <class Body, class Get>
Result<void> get_bodies(ByteReader& in, std::uint64_t smallest, std::vector<Body>& bodies, Get get) {
  const auto count = in.get<std::uint32_t>();
  if (!in.ok() || count * smallest > in.remaining())
    return invalid("content", text("claims ", count, " bodies, too many for ", in.remaining(), " bytes"));
  bodies.resize(count);
  for (std::uint32_t b = 0; b < count; ++b)
    if (!get(bodies[b]) || !in.ok())
      return invalid(text("bodies[", b, "]"), text("cut short or out of range near byte ", in.position()));
  if (!in.at_end()) return invalid("content", text("has ", in.remaining(), " bytes left over"));
  return {};
}

}  // namespace

// ---- messages ---------------------------------------------------------------------------------------------------

std::string encode(const Frame& frame, const FrameReference& reference, Codec codec, bool compress) {
  assert(frame.epoch == reference.epoch());
  const MessageForm form{codec, compress};
  ByteWriter out;
  out.put(frame.step);
  for (const double number : {frame.time, frame.step_ms, frame.real_time_factor})
    out.put(std::isfinite(number) ? number : 0.0);
  out.put(frame.epoch);
  out.put(static_cast<std::uint32_t>(frame.bodies.size()));
  for (const BodyFrame& body : frame.bodies) put_body(out, body, reference.find(body.id), form);
  return close_message(MessageKind::frame, form, out.take());
}

std::vector<std::string> encode(const Topology& topology, std::optional<std::uint32_t> since, Codec codec, bool compress,
                                std::size_t max_content) {
  const MessageForm form{codec, compress};
  const auto lots = lots_of(topology, since, max_content);
  std::vector<std::string> messages;
  for (const auto& lot : lots) {
    ByteWriter out;
    out.put(topology.epoch);
    out.put(since.value_or(kNoBase));
    out.put(static_cast<std::uint32_t>(messages.size()));
    out.put(static_cast<std::uint32_t>(lots.size()));
    out.put(static_cast<std::uint32_t>(lot.size()));
    for (const BodyTopology* body : lot) put_body(out, *body, form);
    messages.push_back(close_message(MessageKind::topology, form, out.take()));
  }
  return messages;
}

std::optional<std::string> too_long(const Topology& topology, std::size_t max_content) {
  std::uint64_t frame = kMessageFields;
  for (const BodyTopology& body : topology.bodies) {
    frame += most_frame_bytes(body);
    if (const std::uint64_t bytes = kMessageFields + most_bytes(body); bytes > max_content)
      return text("what is drawn of body ", body.id, " (", body.name, ") takes ", bytes, " bytes, must be at most ", max_content);
  }
  if (frame > max_content) return text("a frame takes ", frame, " bytes, must be at most ", max_content);
  return {};
}

Result<Frame> decode_frame(std::string_view bytes, const FrameReference& reference) {
  OpenMessage message;
  if (auto ok = open_message(bytes, MessageKind::frame, message); !ok) return std::unexpected(ok.error());
  ByteReader in(message.content);
  Frame frame;
  frame.step = in.get<std::uint64_t>();
  frame.time = in.get<double>();
  frame.step_ms = in.get<double>();
  frame.real_time_factor = in.get<double>();
  frame.epoch = in.get<std::uint32_t>();
  if (!std::isfinite(frame.time) || !std::isfinite(frame.step_ms) || !std::isfinite(frame.real_time_factor))
    return invalid("content", "holds a time that is not finite");
  if (in.ok() && frame.epoch != reference.epoch())
    return invalid("epoch", text("is ", frame.epoch, ", must be ", reference.epoch(), ", that of the topology"));
  const auto get = [&](BodyFrame& body) { return get_body(in, message.form, reference, body); };
  if (auto ok = get_bodies(in, 40, frame.bodies, get); !ok) return std::unexpected(ok.error());
  return frame;
}

Result<TopologyPart> decode_topology_part(std::string_view bytes) {
  OpenMessage message;
  if (auto ok = open_message(bytes, MessageKind::topology, message); !ok) return std::unexpected(ok.error());
  ByteReader in(message.content);
  TopologyPart part;
  part.epoch = in.get<std::uint32_t>();
  if (message.form.version >= 2) {
    const auto base = in.get<std::uint32_t>();
    if (base != kNoBase) part.base = base;
    part.part = in.get<std::uint32_t>();
    part.parts = in.get<std::uint32_t>();
    if (part.base && part.base >= part.epoch) return invalid("base", text("is ", base, ", must be below epoch ", part.epoch));
    if (part.part >= part.parts) return invalid("part", text("is ", part.part, ", must be below the number of parts, ", part.parts));
  }
  const auto get = [&](BodyTopology& body) { return get_body(in, message.form, part.epoch, body); };
  if (auto ok = get_bodies(in, 36, part.bodies, get); !ok) return std::unexpected(ok.error());
  return part;
}

}  // namespace crumple
