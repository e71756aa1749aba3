#include "common/frame_codec.h"

#include "common/byte_stream.h"
#include "common/text.h"

#include <zstd.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

namespace crumple {

namespace {

constexpr char kMagic[4] = {'C', 'R', 'F', 'C'};
constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 16;
constexpr std::uint64_t kMaxZstdRatio = 32768;  // a run of 128 KiB takes four bytes
constexpr int kZstdLevel = 1;
enum Kind : std::uint8_t { kTopology = 1, kFrame = 2 };

struct Form {
  Codec codec;
  bool compress;
};

// A difference modulo 2^16 of either sign as a small number: 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
std::uint16_t zigzag(std::uint16_t difference) {
  return static_cast<std::uint16_t>((difference << 1) ^ (difference & 0x8000 ? 0xffff : 0));
}
std::uint16_t unzigzag(std::uint16_t number) {
  return static_cast<std::uint16_t>((number >> 1) ^ (number & 1 ? 0xffff : 0));
}

// ---- writing ----------------------------------------------------------------------------------------------------

float presentable(double number) {
  return std::abs(number) <= 1e30 ? static_cast<float>(number) : 0.0f;  // also false for NaN
}

void put_text(ByteWriter& out, const std::string& text) {
  out.put(static_cast<std::uint32_t>(text.size()));
  out.append(text.data(), text.size());
  out.pad_to_4();
}

// Of vertices in spatial order neighbours differ little: their differences' high bytes are nearly all zero.
std::string difference_planes(const std::vector<std::uint16_t>& steps) {
  const std::size_t count = steps.size() / 3;
  std::string planes(2 * steps.size(), '\0');
  for (std::size_t a = 0; a < 3; ++a) {
    std::uint16_t last = 0;
    for (std::size_t v = 0; v < count; ++v) {
      const std::uint16_t number = zigzag(static_cast<std::uint16_t>(steps[3 * v + a] - last));
      last = steps[3 * v + a];
      planes[2 * a * count + v] = static_cast<char>(number & 0xff);
      planes[(2 * a + 1) * count + v] = static_cast<char>(number >> 8);
    }
  }
  return planes;
}

void put_positions(ByteWriter& out, const std::vector<Vec3f>& positions, Form form) {
  if (positions.empty()) return;
  std::vector<Vec3f> clean(positions.size());
  for (std::size_t v = 0; v < clean.size(); ++v)
    for (int a = 0; a < 3; ++a) clean[v][a] = presentable(positions[v][a]);
  if (form.codec == Codec::float32) {
    static_assert(sizeof(Vec3f) == 12);
    out.append(clean.data(), 12 * clean.size());
    return;
  }
  Vec3f low = clean[0], high = clean[0];
  for (const Vec3f& p : clean) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vec3f size = high - low;
  out.append(low.data(), 12);
  out.append(size.data(), 12);
  std::vector<std::uint16_t> steps(3 * clean.size());
  for (int a = 0; a < 3; ++a) {
    const double scale = size[a] > 0 ? 65535.0 / size[a] : 0;
    for (std::size_t v = 0; v < clean.size(); ++v)
      steps[3 * v + a] = static_cast<std::uint16_t>(
          std::min(65535.0, std::floor((static_cast<double>(clean[v][a]) - low[a]) * scale + 0.5)));
  }
  if (form.compress) out.append(difference_planes(steps).data(), 2 * steps.size());
  else out.append(steps.data(), 2 * steps.size());
  out.pad_to_4();
}

void put_values(ByteWriter& out, const std::vector<float>& values, Form form) {
  for (const float value : values) {
    const float clean = presentable(value);
    if (form.codec == Codec::float32) out.put(clean);
    else out.put(static_cast<std::uint8_t>(std::clamp(clean, 0.0f, 1.0f) * 255 + 0.5f));
  }
  out.pad_to_4();
}

std::string finish(Kind kind, Form form, std::string content) {
  assert(content.size() <= kMaxContentBytes);
  const auto length = static_cast<std::uint32_t>(content.size());
  if (form.compress) {
    std::string packed(ZSTD_compressBound(content.size()), '\0');
    const std::size_t size = ZSTD_compress(packed.data(), packed.size(), content.data(), content.size(), kZstdLevel);
    assert(!ZSTD_isError(size));
    packed.resize(size);
    content = std::move(packed);
  }
  ByteWriter out;
  out.append(kMagic, 4);
  out.put(kVersion);
  out.put(static_cast<std::uint8_t>(kind));
  out.put(static_cast<std::uint8_t>(form.codec));
  out.put(static_cast<std::uint8_t>(form.compress));
  out.put(length);
  out.put(std::uint32_t{0});
  out.append(content.data(), content.size());
  return out.take();
}

// ---- reading ----------------------------------------------------------------------------------------------------

struct Content {
  Form form;
  std::string_view bytes;
  std::string unpacked;  // what `bytes` looks at if it came compressed
};

Result<void> unpack(std::string_view packed, std::uint32_t length, std::string& out) {
  if (length > kMaxZstdRatio * packed.size())
    return invalid("content", text("claims ", length, " bytes, too many for ", packed.size(), " compressed ones"));
  const std::size_t frame = ZSTD_findFrameCompressedSize(packed.data(), packed.size());
  if (ZSTD_isError(frame) || frame != packed.size()) return invalid("content", "is not one whole zstd frame");
  out.resize(length);
  const std::size_t size = ZSTD_decompress(out.data(), out.size(), packed.data(), packed.size());
  if (ZSTD_isError(size)) return invalid("content", text("does not decompress: ", ZSTD_getErrorName(size)));
  if (size != length) return invalid("content", text("decompresses to ", size, " bytes, must be ", length));
  return {};
}

Result<void> open_message(std::string_view bytes, Kind kind, Content& content) {
  if (bytes.size() < kHeaderBytes) return invalid("message", text("has ", bytes.size(), " bytes, shorter than its header"));
  if (bytes.substr(0, 4) != std::string_view(kMagic, 4)) return invalid("message", "does not begin with CRFC");
  ByteReader header(bytes.substr(4, kHeaderBytes - 4));
  const int version = header.get<std::uint8_t>(), its_kind = header.get<std::uint8_t>();
  const int codec = header.get<std::uint8_t>(), compressed = header.get<std::uint8_t>();
  const auto length = header.get<std::uint32_t>(), reserved = header.get<std::uint32_t>();
  if (version != kVersion) return invalid("version", text("is ", version, ", must be ", int{kVersion}));
  if (its_kind != kind) return invalid("kind", text("is ", its_kind, ", must be ", int{kind}));
  if (codec > 1) return invalid("codec", text("is ", codec, ", must be 0 or 1"));
  if (compressed > 1) return invalid("compressed", text("is ", compressed, ", must be 0 or 1"));
  if (length > kMaxContentBytes) return invalid("length", text("is ", length, ", must be at most ", kMaxContentBytes));
  if (reserved != 0) return invalid("reserved", text("is ", reserved, ", must be 0"));
  content.form = {static_cast<Codec>(codec), compressed == 1};
  content.bytes = bytes.substr(kHeaderBytes);
  if (compressed) {
    if (auto ok = unpack(content.bytes, length, content.unpacked); !ok) return ok;
    content.bytes = content.unpacked;
  }
  if (content.bytes.size() != length)
    return invalid("content", text("has ", content.bytes.size(), " bytes, must have ", length));
  return {};
}

std::optional<std::string> get_text(ByteReader& in) {
  const auto length = in.get<std::uint32_t>();
  const char* data = in.skip(length);
  if (!data) return {};
  std::string text(data, length);
  in.skip_padding();
  return text;
}

void undo_difference_planes(const char* planes, std::vector<std::uint16_t>& steps) {
  const std::size_t count = steps.size() / 3;
  for (std::size_t a = 0; a < 3; ++a) {
    std::uint16_t last = 0;
    for (std::size_t v = 0; v < count; ++v) {
      const auto low = static_cast<std::uint8_t>(planes[2 * a * count + v]);
      const auto high = static_cast<std::uint8_t>(planes[(2 * a + 1) * count + v]);
      last = static_cast<std::uint16_t>(last + unzigzag(static_cast<std::uint16_t>(low | high << 8)));
      steps[3 * v + a] = last;
    }
  }
}

// False: bytes are missing, or a number is not finite. The bytes are there before memory is taken for them.
bool get_positions(ByteReader& in, std::uint32_t count, Form form, std::vector<Vec3f>& positions) {
  if (count == 0) return true;
  if (form.codec == Codec::float32) {
    const char* data = in.skip(std::uint64_t{12} * count);
    if (!data) return false;
    positions.resize(count);
    for (std::size_t v = 0; v < count; ++v) std::memcpy(positions[v].data(), data + 12 * v, 12);
    return std::all_of(positions.begin(), positions.end(), [](const Vec3f& p) { return p.allFinite(); });
  }
  Vec3f low, size;
  for (float& number : low) number = in.get<float>();
  for (float& number : size) number = in.get<float>();
  if (!low.allFinite() || !size.allFinite() || !(low + size).allFinite() || (size.array() < 0).any()) return false;
  const char* data = in.skip(std::uint64_t{6} * count);
  if (!data) return false;
  std::vector<std::uint16_t> steps(3 * std::size_t{count});
  if (form.compress) undo_difference_planes(data, steps);
  else std::memcpy(steps.data(), data, 2 * steps.size());
  positions.resize(count);
  for (std::size_t v = 0; v < count; ++v)
    for (int a = 0; a < 3; ++a)
      positions[v][a] = static_cast<float>(low[a] + static_cast<double>(size[a]) * steps[3 * v + a] / 65535);
  in.skip_padding();
  return in.ok();
}

bool get_values(ByteReader& in, std::uint32_t count, Form form, std::vector<float>& values) {
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

bool get_body(ByteReader& in, Form form, BodyFrame& body) {
  body.id = in.get<std::uint32_t>();
  const auto positions = in.get<std::uint32_t>(), values = in.get<std::uint32_t>();
  Eigen::Matrix<double, 7, 1> pose;
  for (double& number : pose) number = in.get<float>();
  body.pose.R_WB.coeffs() = pose.head<4>();  // Eigen's order: x y z w
  body.pose.p_WB = pose.tail<3>();
  return in.ok() && pose.allFinite() && get_positions(in, positions, form, body.positions) &&
         get_values(in, values, form, body.values);
}

bool get_body(ByteReader& in, Form form, BodyTopology& body) {
  body.id = in.get<std::uint32_t>();
  const auto model = in.get<std::uint8_t>(), deformable = in.get<std::uint8_t>();
  const auto channels = in.get<std::uint16_t>();
  for (float& part : body.colour) part = in.get<float>();
  body.opacity = in.get<float>();
  const auto vertices = in.get<std::uint32_t>(), triangles = in.get<std::uint32_t>();
  if (!in.ok() || model > static_cast<int>(BodyModel::example_based) || deformable > 1) return false;
  if (!Eigen::Map<Vec3f>(body.colour.data()).allFinite() || !std::isfinite(body.opacity)) return false;
  body.model = static_cast<BodyModel>(model);
  body.deformable = deformable;

  for (int i = -1; i < channels; ++i) {
    auto text = get_text(in);
    if (!text) return false;
    if (i < 0) body.name = std::move(*text);
    else body.channels.push_back(std::move(*text));
  }
  if (!get_positions(in, vertices, form, body.vertices)) return false;
  const char* data = in.skip(std::uint64_t{12} * triangles);
  if (!data) return false;
  body.triangles.resize(triangles);
  static_assert(sizeof(Triangle) == 12);
  if (triangles > 0) std::memcpy(body.triangles.data(), data, std::size_t{12} * triangles);
  return std::all_of(body.triangles.begin(), body.triangles.end(), [&](const Triangle& triangle) {
    return std::ranges::all_of(triangle, [&](int v) { return v >= 0 && static_cast<std::uint32_t>(v) < vertices; });
  });
}

// A body takes at least `smallest` bytes, so that a false count cannot claim memory.
template <class Body>
Result<void> get_bodies(ByteReader& in, Form form, std::uint64_t smallest, std::vector<Body>& bodies) {
  const auto count = in.get<std::uint32_t>();
  if (!in.ok() || count * smallest > in.remaining())
    return invalid("content", text("claims ", count, " bodies, too many for ", in.remaining(), " bytes"));
  bodies.resize(count);
  for (std::uint32_t b = 0; b < count; ++b)
    if (!get_body(in, form, bodies[b]) || !in.ok())
      return invalid(text("bodies[", b, "]"), text("cut short or out of range near byte ", in.position()));
  if (!in.at_end()) return invalid("content", text("has ", in.remaining(), " bytes left over"));
  return {};
}

}  // namespace

std::string encode(const Frame& frame, Codec codec, bool compress) {
  const Form form{codec, compress};
  ByteWriter out;
  out.put(frame.step);
  for (const double number : {frame.time, frame.step_ms, frame.real_time_factor})
    out.put(std::isfinite(number) ? number : 0.0);
  out.put(frame.epoch);
  out.put(static_cast<std::uint32_t>(frame.bodies.size()));
  for (const BodyFrame& body : frame.bodies) {
    out.put(body.id);
    out.put(static_cast<std::uint32_t>(body.positions.size()));
    out.put(static_cast<std::uint32_t>(body.values.size()));
    for (const double number : body.pose.R_WB.coeffs()) out.put(presentable(number));
    for (const double number : body.pose.p_WB) out.put(presentable(number));
    put_positions(out, body.positions, form);
    put_values(out, body.values, form);
  }
  return finish(kFrame, form, out.take());
}

std::string encode(const Topology& topology, Codec codec, bool compress) {
  const Form form{codec, compress};
  ByteWriter out;
  out.put(topology.epoch);
  out.put(static_cast<std::uint32_t>(topology.bodies.size()));
  for (const BodyTopology& body : topology.bodies) {
    assert(body.channels.size() <= 0xffff);
    out.put(body.id);
    out.put(static_cast<std::uint8_t>(body.model));
    out.put(static_cast<std::uint8_t>(body.deformable));
    out.put(static_cast<std::uint16_t>(body.channels.size()));
    for (const float part : body.colour) out.put(presentable(part));
    out.put(presentable(body.opacity));
    out.put(static_cast<std::uint32_t>(body.vertices.size()));
    out.put(static_cast<std::uint32_t>(body.triangles.size()));
    put_text(out, body.name);
    for (const std::string& channel : body.channels) put_text(out, channel);
    put_positions(out, body.vertices, form);
    out.append(body.triangles.data(), 12 * body.triangles.size());
  }
  return finish(kTopology, form, out.take());
}

Result<Frame> decode_frame(std::string_view bytes) {
  Content content;
  if (auto ok = open_message(bytes, kFrame, content); !ok) return std::unexpected(ok.error());
  ByteReader in(content.bytes);
  Frame frame;
  frame.step = in.get<std::uint64_t>();
  frame.time = in.get<double>();
  frame.step_ms = in.get<double>();
  frame.real_time_factor = in.get<double>();
  frame.epoch = in.get<std::uint32_t>();
  if (!std::isfinite(frame.time) || !std::isfinite(frame.step_ms) || !std::isfinite(frame.real_time_factor))
    return invalid("content", "holds a time that is not finite");
  if (auto ok = get_bodies(in, content.form, 40, frame.bodies); !ok) return std::unexpected(ok.error());
  return frame;
}

Result<Topology> decode_topology(std::string_view bytes) {
  Content content;
  if (auto ok = open_message(bytes, kTopology, content); !ok) return std::unexpected(ok.error());
  ByteReader in(content.bytes);
  Topology topology;
  topology.epoch = in.get<std::uint32_t>();
  if (auto ok = get_bodies(in, content.form, 36, topology.bodies); !ok) return std::unexpected(ok.error());
  return topology;
}

}  // namespace crumple
