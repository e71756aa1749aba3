#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace crumple::viewer {

struct PageFile {
  std::string type;   // media type
  std::string bytes;
};

// The built page, read once. Only what was found in the folder at start is served: no path from outside ever reaches the
// file system.
class PageFiles {
 public:
  explicit PageFiles(const std::filesystem::path& folder);

  bool empty() const { return files_.empty(); }
  // `target`: of the HTTP request, "/" is index.html; a query is ignored. Null if there is none.
  const PageFile* find(std::string_view target) const;

 private:
  std::map<std::string, PageFile, std::less<>> files_;  // by path with a leading slash
};

}  // namespace crumple::viewer
