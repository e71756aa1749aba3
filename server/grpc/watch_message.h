#pragma once

#include "crumple/v1/simulation.pb.h"
#include "server/runtime/frame_hub.h"

#include <grpcpp/support/byte_buffer.h>

// Messages of the Watch stream as raw bytes, so that a payload is shared by all streams that send it: a response is a
// slice of its own with the small fields, and a slice that refers to the payload.
namespace crumple::grpc_server {

// A serialised WatchResponse. Not for Closed, which is a status.
grpc::ByteBuffer to_bytes(const runtime::Delivery& delivery);

// False if the bytes are not a WatchRequest.
bool parse(const grpc::ByteBuffer& bytes, v1::WatchRequest& request);

}  // namespace crumple::grpc_server
