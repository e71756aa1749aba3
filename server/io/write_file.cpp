#include "server/io/write_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>

namespace crumple::io {

Result<void> write_file(const std::filesystem::path& file, std::string_view content) {
  std::filesystem::path part = file;
  part += ".part";
  {
    std::ofstream out(part, std::ios::binary);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    out.close();
    if (!out) {
      return std::unexpected(Error{ErrorCode::unavailable, file.string(), std::string("cannot be written: ") + std::strerror(errno)});
    }
  }
  std::error_code failure;
  std::filesystem::rename(part, file, failure);
  if (failure) return std::unexpected(Error{ErrorCode::unavailable, file.string(), "cannot be written: " + failure.message()});
  return {};
}

}  // namespace crumple::io
