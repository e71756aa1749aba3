#include "server/grpc/convert.h"
#include "server/scene_convert/event_convert.h"

#include <gtest/gtest.h>

#include "client/sdk/message_convert.h"
#include "crumple/v1/error.pb.h"

namespace crumple::grpc_server {
namespace {

TEST(ToStatus, NamesTheFieldInMessageAndDetails) {
  const Error error{ErrorCode::invalid_argument, "scene.bodies[2].fem.material.poisson_ratio", "is 0.5, must be below 0.5"};
  const grpc::Status status = to_status(error);
  EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), error.text());
  v1::ErrorStatus details;
  ASSERT_TRUE(details.ParseFromString(status.error_details()));
  EXPECT_EQ(details.code(), 3);
  ASSERT_EQ(details.details_size(), 1);
  EXPECT_EQ(details.details(0).type_url(), "type.googleapis.com/google.rpc.BadRequest");
  v1::BadRequest request;
  ASSERT_TRUE(request.ParseFromString(details.details(0).value()));
  EXPECT_EQ(request.field_violations(0).field(), error.field);
}

TEST(ToStatus, ComesBackAsTheSameError) {
  for (const Error& error : {Error{ErrorCode::not_found, "world", "is 7, there is no such world"},
                             Error{ErrorCode::unavailable, "", "the server is stopping"},
                             Error{ErrorCode::failed_precondition, "", "world 1 plays"},
                             Error{ErrorCode::resource_exhausted, "", "full"}, Error{ErrorCode::internal, "", "fault"}}) {
    const Error back = client::to_error(to_status(error));
    EXPECT_EQ(back.code, error.code);
    EXPECT_EQ(back.field, error.field);
    EXPECT_EQ(back.message, error.message);
  }
}

TEST(ToMessage, WhoSleepsComesBack) {
  const WorldStatus status{.id = 3, .bodies = 9, .asleep = 4, .viewers = 2};
  const WorldStatus back = client::from_message(to_message(status));
  EXPECT_EQ((std::vector{back.bodies, back.asleep, back.viewers}), (std::vector{9, 4, 2}));
  EXPECT_TRUE(client::from_message(to_message(BodyStatus{.id = 1, .asleep = true})).asleep);
  EXPECT_FALSE(client::from_message(to_message(BodyStatus{.id = 1})).asleep);
}

TEST(ToMessage, EventsComeBackWhole) {
  const sim::Event event{.sequence = 9, .step = 4, .time = 0.5, .kind = sim::EventKind::frozen, .body = 3,
                         .point = Vec3(1, 2, 3), .magnitude = 7, .count = 5, .fragments = 6, .epoch = 8, .message = "held",
                         .particles = {{Vec3f(1, 2, 3), Vec3f(4, 5, 6)}, {Vec3f(7, 8, 9), Vec3f(0, 0, 1)}}};
  const client::WorldEvent back = client::from_message(scene_convert::to_message(event));
  EXPECT_EQ(back.sequence, 9u);
  EXPECT_EQ(back.kind, client::EventKind::frozen);
  EXPECT_EQ(back.point, Vec3(1, 2, 3));
  EXPECT_EQ(back.fragments, 6);
  EXPECT_EQ(back.message, "held");
  ASSERT_EQ(back.particles.size(), 2u);
  EXPECT_EQ(back.particles[0].velocity, Vec3f(4, 5, 6));
  EXPECT_EQ(back.particles[1].position, Vec3f(7, 8, 9));
  EXPECT_EQ(client::to_message(back).SerializeAsString(), scene_convert::to_message(event).SerializeAsString());
}

}  // namespace
}  // namespace crumple::grpc_server
