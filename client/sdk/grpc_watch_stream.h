#pragma once

#include "client/sdk/watch_stream.h"
#include "crumple/v1/simulation.grpc.pb.h"

#include <grpcpp/client_context.h>

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>

namespace crumple::client {

// A Watch call. A thread of its own reads into a short queue; when the caller leaves it full, reading stops, and the
// server sees a slow client.
class GrpcWatchStream final : public WatchStream {
 public:
  // Answers when the server has accepted the subscription.
  static Result<std::unique_ptr<WatchStream>> open(v1::SimulationService::Stub& stub, WorldId world,
                                                   const WatchOptions& options);
  ~GrpcWatchStream() override;

  Result<std::optional<EncodedUpdate>> next_encoded(std::chrono::milliseconds timeout) override;
  void close() override;

 private:
  using Stream = grpc::ClientReaderWriter<v1::WatchRequest, v1::WatchResponse>;

  GrpcWatchStream(v1::SimulationService::Stub& stub) : stream_(stub.Watch(&context_)) {}
  void read();

  grpc::ClientContext context_;
  std::unique_ptr<Stream> stream_;
  bool owes_credit_ = false;

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<EncodedUpdate> queue_;
  bool closed_ = false;
  std::optional<Error> end_;
  std::thread reader_;
};

}  // namespace crumple::client
