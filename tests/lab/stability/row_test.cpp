#include "tests/lab/stability/row_outcomes.h"

#include <set>

namespace crumple::lab::stability {
namespace {

TEST(StabilityRows, AreThe41OfTheLiteratureEachWithATestACriterionAndAMethod) {
  const std::vector<Row>& rows = all_rows();
  ASSERT_EQ(rows.size(), 41u);
  for (int k = 0; k < 41; ++k) {
    EXPECT_EQ(rows[k].number, k + 1);
    EXPECT_FALSE(rows[k].name.empty() || rows[k].test.empty() || rows[k].criterion.empty()) << k + 1;
    EXPECT_TRUE(rows[k].check) << k + 1;
    EXPECT_FALSE(methods_of(rows[k].family).empty()) << k + 1;
    for (const Missing& missing : rows[k].not_built)
      EXPECT_FALSE(missing.method.empty() || missing.what.empty()) << k + 1;
  }
}

TEST(StabilityMethods, HaveKeysOfTheirOwnAndEveryFamilyHasOneThatIsOffered) {
  std::set<std::string> keys;
  std::set<Family> offered, families;
  for (const Method& method : all_methods()) {
    EXPECT_TRUE(keys.insert(method.key).second) << method.key;
    EXPECT_EQ(method.key.find_first_of(", "), std::string::npos) << method.key;
    families.insert(method.family);
    if (method.standing == Standing::offered) offered.insert(method.family);
  }
  EXPECT_EQ(offered, families);
}

}  // namespace
}  // namespace crumple::lab::stability
