#pragma once

#include "client/sdk/watch_stream.h"
#include "common/world_status.h"
#include "crumple/v1/simulation.pb.h"

#include <grpcpp/support/status.h>

// Messages and statuses of the service <-> values of the SDK.
namespace crumple::client {

// The field is read from the status details. Codes that are not Error's: the call's deadline and cancelling become
// unavailable, the rest internal.
Error to_error(const grpc::Status& status);

WorldStatus from_message(const v1::WorldStatus& message);
BodyStatus from_message(const v1::BodyStatus& message);
StepSummary from_message(const v1::StepResponse& message);
WorldEvent from_message(const v1::Event& message);
v1::Event to_message(const WorldEvent& event);

// Takes the payload out of the message. Nothing for kinds of updates that are newer than this client.
std::optional<EncodedUpdate> take_update(v1::WatchResponse& message);
v1::WatchResponse to_message(const EncodedUpdate& update);

}  // namespace crumple::client
