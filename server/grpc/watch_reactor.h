#pragma once

#include "crumple/v1/simulation.pb.h"
#include "server/runtime/world_registry.h"

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <memory>
#include <mutex>
#include <optional>

namespace crumple::grpc_server {

// One Watch stream: requests grant credits to a FrameReader, what the reader delivers is written, one write at a time.
// Owns itself from start() until gRPC is done with it, however the client leaves.
class WatchReactor final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                           public std::enable_shared_from_this<WatchReactor> {
 public:
  static WatchReactor* start(const runtime::WorldRegistry& registry, grpc::CallbackServerContext& context);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  WatchReactor(const runtime::WorldRegistry& registry, grpc::CallbackServerContext& context)
      : registry_(registry), context_(context) {}

  Result<void> take(const v1::WatchRequest& request);
  Result<void> subscribe(const v1::Subscribe& request);
  void write_next();
  void finish(grpc::Status status);

  const runtime::WorldRegistry& registry_;
  grpc::CallbackServerContext& context_;
  std::shared_ptr<WatchReactor> self_;

  // gRPC may call back from inside StartRead, StartWrite and Finish, hence recursive; it is held while they are called,
  // because none of them may follow Finish.
  std::recursive_mutex mutex_;
  grpc::ByteBuffer incoming_, outgoing_;
  std::unique_ptr<runtime::FrameReader> reader_;
  bool writing_ = false;
  bool finished_ = false;
};

}  // namespace crumple::grpc_server
