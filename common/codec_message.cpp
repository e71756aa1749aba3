#include "common/codec_message.h"

#include "common/byte_stream.h"
#include "common/text.h"

#include <zstd.h>

#include <cassert>

namespace crumple {
namespace {

constexpr char kMagic[4] = {'C', 'R', 'F', 'C'};
constexpr std::size_t kHeaderBytes = 16;
constexpr std::uint64_t kMaxZstdRatio = 32768;  // a run of 128 KiB takes four bytes
constexpr int kZstdLevel = 1;

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

}  // namespace

std::string close_message(MessageKind kind, MessageForm form, std::string content) {
  assert(content.size() <= kMaxContentBytes && form.version == kCodecVersion);
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
  out.put(static_cast<std::uint8_t>(form.version));
  out.put(static_cast<std::uint8_t>(kind));
  out.put(static_cast<std::uint8_t>(form.codec));
  out.put(static_cast<std::uint8_t>(form.compress));
  out.put(length);
  out.put(std::uint32_t{0});
  out.append(content.data(), content.size());
  return out.take();
}

Result<void> open_message(std::string_view bytes, MessageKind kind, OpenMessage& message) {
  if (bytes.size() < kHeaderBytes) return invalid("message", text("has ", bytes.size(), " bytes, shorter than its header"));
  if (bytes.substr(0, 4) != std::string_view(kMagic, 4)) return invalid("message", "does not begin with CRFC");
  ByteReader header(bytes.substr(4, kHeaderBytes - 4));
  const int version = header.get<std::uint8_t>(), its_kind = header.get<std::uint8_t>();
  const int codec = header.get<std::uint8_t>(), compressed = header.get<std::uint8_t>();
  const auto length = header.get<std::uint32_t>(), reserved = header.get<std::uint32_t>();
  if (version < 1 || version > kCodecVersion) return invalid("version", text("is ", version, ", must be 1 or ", kCodecVersion));
  if (its_kind != static_cast<int>(kind)) return invalid("kind", text("is ", its_kind, ", must be ", static_cast<int>(kind)));
  if (codec > 1) return invalid("codec", text("is ", codec, ", must be 0 or 1"));
  if (compressed > 1) return invalid("compressed", text("is ", compressed, ", must be 0 or 1"));
  if (length > kMaxContentBytes) return invalid("length", text("is ", length, ", must be at most ", kMaxContentBytes));
  if (reserved != 0) return invalid("reserved", text("is ", reserved, ", must be 0"));
  message.form = {static_cast<Codec>(codec), compressed == 1, version};
  message.content = bytes.substr(kHeaderBytes);
  if (compressed) {
    if (auto ok = unpack(message.content, length, message.unpacked); !ok) return ok;
    message.content = message.unpacked;
  }
  if (message.content.size() != length)
    return invalid("content", text("has ", message.content.size(), " bytes, must have ", length));
  return {};
}

}  // namespace crumple
