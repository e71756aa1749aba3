#pragma once

#include "common/error.h"
#include "common/world_status.h"
#include "crumple/v1/simulation.pb.h"
#include "server/sim/event.h"

#include <grpcpp/support/status.h>

// Our values <-> messages and statuses of the service.
namespace crumple::grpc_server {

// Code and "field message"; if the error names a field, the status details hold it as an ErrorStatus with one
// BadRequest, as google.rpc's clients expect.
grpc::Status to_status(const Error& error);

template <class T>
grpc::Status to_status(const Result<T>& result) {
  return result ? grpc::Status::OK : to_status(result.error());
}

// The error of a part of a request: `prefix` and a dot before its field.
Error within(const std::string& prefix, Error error);

v1::WorldStatus to_message(const WorldStatus& status);
v1::BodyStatus to_message(const BodyStatus& body);
v1::StepResponse to_message(const StepSummary& summary);

}  // namespace crumple::grpc_server
