#pragma once

#include "client/sdk/watch_stream.h"
#include "server/runtime/frame_hub.h"

#include <condition_variable>
#include <memory>
#include <mutex>

namespace crumple::client {

class InProcessWatchStream final : public WatchStream {
 public:
  InProcessWatchStream(runtime::FrameHub& hub, const WatchOptions& options);

  Result<std::optional<EncodedUpdate>> next_encoded(std::chrono::milliseconds timeout) override;
  void close() override;

 private:
  // Outlives the stream while the hub's last notification is on its way.
  struct Signal {
    std::mutex mutex;
    std::condition_variable wake;
    bool raised = false;
    bool closed = false;
  };

  const std::shared_ptr<Signal> signal_ = std::make_shared<Signal>();
  bool owes_credit_ = false;
  std::optional<Error> end_;
  std::unique_ptr<runtime::FrameReader> reader_;
};

}  // namespace crumple::client
