// crumple-lab stability as a program: what it prints and its exit codes.
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace crumple {
namespace {

using Json = nlohmann::json;

struct Ran {
  int exit_code;
  Json json;
};

Ran stability(std::vector<std::string> words) {
  words.insert(words.begin(), {test::program("crumple-lab"), "stability"});
  test::ChildProcess child(words);
  EXPECT_TRUE(child.started());
  const std::string line = child.read_line();
  const int exit_code = child.wait();
  return {exit_code, Json::parse(line, nullptr, false)};
}

TEST(StabilityProgram, PrintsTheOutcomesOfOneRow) {
  const Ran ran = stability({"--only", "33"});
  EXPECT_EQ(ran.exit_code, 0);
  EXPECT_EQ(ran.json["eq8"]["verdict"], "pass");
  EXPECT_EQ(ran.json["eq9-raw"]["verdict"], "limit");
}

TEST(StabilityProgram, ExitsWithOneAndTheRowNamedWhereItFellBehind) {
  test::TemporaryFolder folder;
  folder.write("well.json", R"({"rows": {"33 eq9-raw": {"verdict": "limit", "value": 192450}}, "cells": {}})");
  folder.write("behind.json", R"({"rows": {"33 eq9-raw": {"verdict": "pass", "value": 1}}, "cells": {}})");
  folder.write("better.json", R"({"rows": {"33 eq8": {"verdict": "fails", "value": 1}}, "cells": {}})");
  const auto run = [&](const char* file) {
    return stability({"--ci", "--only", "33", "--baseline", (folder.path() / file).string()});
  };
  EXPECT_EQ(run("well.json").exit_code, 0);
  const Ran behind = run("behind.json");
  EXPECT_EQ(behind.exit_code, 1);
  ASSERT_EQ(behind.json["inward"].size(), 1u);
  EXPECT_NE(behind.json["inward"][0].get<std::string>().find("row 33, Pseudo-inverse"), std::string::npos);
  const Ran better = run("better.json");
  EXPECT_EQ(better.exit_code, 0);
  EXPECT_EQ(better.json["outward"].size(), 1u);
}

TEST(StabilityProgram, ExitsWithTwoOnBadInput) {
  test::TemporaryFolder folder;
  folder.write("broken.json", "{");
  const std::vector<std::vector<std::string>> bad{{},
                                                  {"--only", "42"},
                                                  {"--ci"},
                                                  {"--ci", "--baseline", "/no/such/file"},
                                                  {"--ci", "--baseline", (folder.path() / "broken.json").string()},
                                                  {"--out", "/proc/no/folder"}};
  for (const auto& words : bad) EXPECT_EQ(stability(words).exit_code, 2) << testing::PrintToString(words);
}

}  // namespace
}  // namespace crumple
