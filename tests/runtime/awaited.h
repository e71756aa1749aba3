#pragma once

#include "server/runtime/frame_hub.h"
#include "server/runtime/world_runner.h"

#include <chrono>
#include <condition_variable>
#include <future>
#include <memory>
#include <mutex>
#include <optional>

namespace crumple::test {

inline constexpr std::chrono::seconds kDeadline{20};  // generous: it only passes when something hangs

// The answer to come of a call that takes a done callback.
template <class T>
class Pending {
 public:
  runtime::Done<T> done() const {
    return [promise = promise_](Result<T> result) { promise->set_value(std::move(result)); };
  }
  Result<T> get() {
    auto answer = promise_->get_future();
    if (answer.wait_for(kDeadline) == std::future_status::ready) return answer.get();
    return std::unexpected(Error{ErrorCode::unavailable, "", "no answer before the test's deadline"});
  }

 private:
  std::shared_ptr<std::promise<Result<T>>> promise_ = std::make_shared<std::promise<Result<T>>>();
};

template <class T, class Start>
Result<T> await(Start start) {
  Pending<T> pending;
  start(pending.done());
  return pending.get();
}

// Wakes whoever waits for the next delivery.
class Bell {
 public:
  void ring() {
    const std::lock_guard lock(mutex_);
    rung_ = true;
    wake_.notify_all();
  }
  bool wait() {
    std::unique_lock lock(mutex_);
    const bool rung = wake_.wait_for(lock, kDeadline, [&] { return rung_; });
    rung_ = false;
    return rung;
  }

 private:
  std::mutex mutex_;
  std::condition_variable wake_;
  bool rung_ = false;
};

// A reader and the bell that its hub rings.
struct BellReader {
  std::shared_ptr<Bell> bell = std::make_shared<Bell>();
  std::unique_ptr<runtime::FrameReader> reader;

  BellReader(runtime::FrameHub& hub, const runtime::ReaderOptions& options)
      : reader(hub.subscribe(options, [b = bell] { b->ring(); })) {}

  // The next delivery; nothing if none comes before the deadline.
  std::optional<runtime::Delivery> next() {
    while (true) {
      if (auto delivery = reader->poll()) return delivery;
      if (!bell->wait()) return std::nullopt;
    }
  }
  // The next delivery of that kind; others are dropped.
  template <class Kind>
  std::optional<Kind> next_of() {
    while (auto delivery = next())
      if (auto* kind = std::get_if<Kind>(&*delivery)) return std::move(*kind);
    return std::nullopt;
  }
};

}  // namespace crumple::test
