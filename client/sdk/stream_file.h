#pragma once

#include "client/sdk/watch_stream.h"

#include <fstream>
#include <optional>
#include <string>

// A stream kept in a file: the updates as they came, one after another, each a crumple.v1.WatchResponse
// (simulation.proto) behind its length in bytes as a protobuf varint. Any protobuf library reads it as "delimited"
// messages. An UpdateDecoder that is given all of them in order decodes them.
namespace crumple::client {

class StreamFileWriter {
 public:
  // Error invalid_argument if the file cannot be written; an older one is replaced.
  static Result<StreamFileWriter> create(const std::string& path);
  Result<void> write(const EncodedUpdate& update);  // error unavailable: the disk is full or gone
  Result<void> finish();                            // flushes; nothing may follow
  std::uint64_t bytes() const { return bytes_; }

 private:
  std::string path_;
  std::ofstream file_;
  std::uint64_t bytes_ = 0;
};

class StreamFileReader {
 public:
  static Result<StreamFileReader> open(const std::string& path);  // error not_found
  // The next update; nothing at the end of the file. Error invalid_argument: not such a file, or cut short.
  Result<std::optional<EncodedUpdate>> next();

 private:
  std::string path_;
  std::ifstream file_;
};

}  // namespace crumple::client
