#include "client/sdk/stream_file.h"

#include "client/sdk/message_convert.h"

#include <google/protobuf/io/coded_stream.h>

namespace crumple::client {
namespace {

constexpr std::uint64_t kMaxMessage = (std::uint64_t{1} << 28) + (1 << 20);  // a payload and its small fields

// The varint at the reading position; nothing at the end of the file or if it is cut short or too long.
std::optional<std::uint64_t> read_varint(std::istream& in) {
  std::uint64_t value = 0;
  for (int shift = 0; shift < 64; shift += 7) {
    const int byte = in.get();
    if (byte == std::istream::traits_type::eof()) return std::nullopt;
    value |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
    if ((byte & 0x80) == 0) return value;
  }
  return std::nullopt;
}

}  // namespace

Result<StreamFileWriter> StreamFileWriter::create(const std::string& path) {
  StreamFileWriter writer;
  writer.path_ = path;
  writer.file_.open(path, std::ios::binary | std::ios::trunc);
  if (!writer.file_) return invalid(path, "cannot be written");
  return writer;
}

Result<void> StreamFileWriter::write(const EncodedUpdate& update) {
  using google::protobuf::io::CodedOutputStream;
  const std::string message = to_message(update).SerializeAsString();
  std::uint8_t length[10];
  const std::uint8_t* end = CodedOutputStream::WriteVarint64ToArray(message.size(), length);
  file_.write(reinterpret_cast<const char*>(length), end - length);
  file_.write(message.data(), static_cast<std::streamsize>(message.size()));
  if (!file_) return std::unexpected(Error{ErrorCode::unavailable, path_, "writing failed"});
  bytes_ += static_cast<std::uint64_t>(end - length) + message.size();
  return {};
}

Result<void> StreamFileWriter::finish() {
  file_.close();
  if (!file_) return std::unexpected(Error{ErrorCode::unavailable, path_, "writing failed"});
  return {};
}

Result<StreamFileReader> StreamFileReader::open(const std::string& path) {
  StreamFileReader reader;
  reader.path_ = path;
  reader.file_.open(path, std::ios::binary);
  if (!reader.file_) return std::unexpected(Error{ErrorCode::not_found, path, "cannot be read"});
  return reader;
}

Result<std::optional<EncodedUpdate>> StreamFileReader::next() {
  while (true) {
    if (file_.peek() == std::ifstream::traits_type::eof()) return std::nullopt;
    const std::optional<std::uint64_t> size = read_varint(file_);
    if (!size || *size > kMaxMessage) return invalid(path_, "is cut short or not a stream of crumple.v1.WatchResponse");
    std::string bytes;
    // In pieces: a length that lies must not take memory that the file does not have.
    while (bytes.size() < *size && file_) {
      const std::size_t begin = bytes.size();
      bytes.resize(std::min<std::uint64_t>(*size, begin + (1 << 20)));
      file_.read(bytes.data() + begin, static_cast<std::streamsize>(bytes.size() - begin));
    }
    v1::WatchResponse message;
    if (!file_ || !message.ParseFromString(bytes))
      return invalid(path_, "is cut short or not a stream of crumple.v1.WatchResponse");
    if (auto update = take_update(message)) return update;  // else: newer than this program
  }
}

}  // namespace crumple::client
