#pragma once

#include <filesystem>
#include <string>

// Reference data that lies beside the repository on developers' machines and in CI, not on a user's. A test that needs
// it begins with CRUMPLE_NEED_SHARED("yardstick/S01_patch_test").
namespace crumple::test {

inline std::filesystem::path shared_data(const std::string& name) {
  return std::filesystem::path(CRUMPLE_SOURCE_DIR).parent_path() / "shared" / name;
}

}  // namespace crumple::test

#define CRUMPLE_NEED_SHARED(name)                                                             \
  if (!std::filesystem::exists(::crumple::test::shared_data(name)))                           \
  GTEST_SKIP() << "reference data " << (name) << " does not lie beside this repository"
