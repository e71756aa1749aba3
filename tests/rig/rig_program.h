#pragma once

#include "tests/support/child_process.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>

// crumple-rig as a program.
namespace crumple::rig {

using nlohmann::json;

inline constexpr const char* kBlock =
    "v -1 0 -0.5\nv 1 0 -0.5\nv 1 1 -0.5\nv -1 1 -0.5\nv -1 0 0.5\nv 1 0 0.5\nv 1 1 0.5\nv -1 1 0.5\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 4 1 5 8\n";

// The exit code, and what was printed as JSON.
inline std::pair<int, json> run(std::vector<std::string> words) {
  words.insert(words.begin(), test::program("crumple-rig"));
  test::ChildProcess program(words);
  EXPECT_TRUE(program.started());
  std::string text;
  for (std::string line = program.read_line(); !line.empty(); line = program.read_line()) text += line;
  const int code = program.wait();
  return {code, json::parse(text, nullptr, false)};
}

inline std::string content_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace crumple::rig
