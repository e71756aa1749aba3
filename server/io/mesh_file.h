#pragma once

#include "common/error.h"

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>

namespace crumple::io {

// A file's ending in small letters, with its dot.
std::string small_ending(const std::filesystem::path& file);

// Whether that is one of `endings` (".obj").
bool has_ending(const std::filesystem::path& file, std::initializer_list<std::string_view> endings);

// Errors, naming the file: there is none (not_found), it is no regular file, it is empty, it is larger than `limit`.
Result<void> check_file(const std::filesystem::path& file, std::uintmax_t limit);

// The whole of a file, checked so.
Result<std::string> read_whole(const std::filesystem::path& file, std::uintmax_t limit);

}  // namespace crumple::io
