#include "client/viewer/page_command.h"

#include <gtest/gtest.h>

namespace crumple::viewer {
namespace {

TEST(PageCommand, ReadsAPush) {
  const auto request = parse_request(R"({"type": "push", "body": 3, "point": [1, 2, 3], "impulse": [0, 0, -5.5]})");
  ASSERT_TRUE(request);
  EXPECT_EQ(request->kind, PageRequest::Kind::push);
  EXPECT_EQ(request->body, 3u);
  EXPECT_EQ(request->point, Vec3(1, 2, 3));
  EXPECT_EQ(request->impulse, Vec3(0, 0, -5.5));
}

TEST(PageCommand, ReadsSwitchesAndSteps) {
  EXPECT_TRUE(parse_request(R"({"type": "values", "on": true})")->on);
  EXPECT_EQ(parse_request(R"({"type": "step", "count": 7})")->count, 7u);
  for (const char* type : {"credit", "play", "pause", "restart"}) {
    EXPECT_TRUE(parse_request(std::string(R"({"type": ")") + type + "\"}")) << type;
  }
}

TEST(PageCommand, NamesTheFieldThatIsWrong) {
  const std::pair<const char*, const char*> wrong[] = {
      {"", ""}, {"[]", ""}, {"{", ""}, {R"({})", "type"}, {R"({"type": 4})", "type"}, {R"({"type": "explode"})", "type"},
      {R"({"type": "values"})", "on"}, {R"({"type": "values", "on": 1})", "on"},
      {R"({"type": "step"})", "count"}, {R"({"type": "step", "count": -1})", "count"}, {R"({"type": "step", "count": 10001})", "count"},
      {R"({"type": "push", "point": [0,0,0], "impulse": [0,0,0]})", "body"},
      {R"({"type": "push", "body": 1.5, "point": [0,0,0], "impulse": [0,0,0]})", "body"},
      {R"({"type": "push", "body": 0, "point": [0,0], "impulse": [0,0,0]})", "point"},
      {R"({"type": "push", "body": 0, "point": [0,0,"x"], "impulse": [0,0,0]})", "point"},
      {R"({"type": "push", "body": 0, "point": [0,0,0], "impulse": [0,0,1e999]})", "impulse"}};
  for (const auto& [json, field] : wrong) {
    const auto request = parse_request(json);
    ASSERT_FALSE(request) << json;
    if (std::string(json).find("1e999") == std::string::npos) EXPECT_EQ(request.error().field, field) << json;
  }
}

}  // namespace
}  // namespace crumple::viewer
