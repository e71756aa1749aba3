#pragma once

#include "common/error.h"

#include <filesystem>
#include <string_view>

namespace crumple::io {

// Writes the whole file under another name and renames it, so that a reader never sees half of it.
// Errors name the file and the system's reason.
Result<void> write_file(const std::filesystem::path& file, std::string_view content);

}  // namespace crumple::io
