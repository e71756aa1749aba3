#pragma once

#include "common/error.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <iostream>
#include <string>

// What commands of crumple-lab do alike; exit codes are those of --help.
namespace crumple::lab {

inline int fail(const Error& error) {
  std::cerr << "crumple-lab: " << error.text() << "\n";
  return error.code == ErrorCode::invalid_argument ? 2 : 1;
}

inline int print(const nlohmann::json& json) {
  std::cout << json.dump() << "\n";
  return 0;
}

inline int print_outcome(const Result<nlohmann::json>& result) { return result ? print(*result) : fail(result.error()); }

// The folder of --out, made if it is not there. Errors: it cannot be made.
inline Result<std::filesystem::path> make_out_folder(const std::string& out) {
  std::error_code failed;
  std::filesystem::create_directories(out, failed);
  if (failed) return invalid("--out", "is " + out + ", which cannot be made: " + failed.message());
  return out;
}

}  // namespace crumple::lab
