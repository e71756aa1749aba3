#pragma once

#include "crumple/v1/scene.pb.h"

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <string>

namespace crumple::test {

// A message from protobuf's text format.
template <class Message>
Message parse(const std::string& text) {
  Message message;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &message)) << text;
  return message;
}

}  // namespace crumple::test
