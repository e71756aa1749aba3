#include "client/viewer/page_files.h"

#include <fstream>
#include <sstream>

namespace crumple::viewer {
namespace {

std::string media_type(const std::filesystem::path& file) {
  static const std::map<std::string, std::string> types{{".html", "text/html; charset=utf-8"}, {".js", "text/javascript"},
                                                        {".css", "text/css"}, {".svg", "image/svg+xml"}, {".png", "image/png"}};
  const auto type = types.find(file.extension().string());
  return type == types.end() ? "application/octet-stream" : type->second;
}

}  // namespace

PageFiles::PageFiles(const std::filesystem::path& folder) {
  std::error_code failure;
  for (std::filesystem::recursive_directory_iterator at(folder, failure), end; !failure && at != end; at.increment(failure)) {
    if (!at->is_regular_file()) continue;
    std::ostringstream bytes;
    bytes << std::ifstream(at->path(), std::ios::binary).rdbuf();
    const std::string name = "/" + std::filesystem::relative(at->path(), folder).generic_string();
    files_[name] = {media_type(at->path()), std::move(bytes).str()};
  }
}

const PageFile* PageFiles::find(std::string_view target) const {
  target = target.substr(0, target.find('?'));
  const auto file = files_.find(target == "/" ? "/index.html" : target);
  return file == files_.end() ? nullptr : &file->second;
}

}  // namespace crumple::viewer
