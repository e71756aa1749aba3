#include "client/viewer/page_session.h"

#include "common/text.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>

namespace crumple::viewer {
namespace {

using std::chrono::milliseconds;
constexpr std::size_t kMaxRequestBytes = 64 * 1024;
constexpr std::size_t kMaxQueued = 4096;  // a page that reads nothing is let go

}  // namespace

PageSession::PageSession(Socket socket, ViewedWorld& world) : socket_(std::move(socket)), world_(world) {
  socket_.read_message_max(kMaxRequestBytes);
}

PageSession::~PageSession() { end(); }

void PageSession::end() {
  stop();
  if (watcher_.joinable()) watcher_.join();
}

void PageSession::start() {
  // The watcher keeps the session alive only while it posts; the pending read does so otherwise.
  watcher_ = std::thread([this] { watch(); });
  read();
}

void PageSession::stop() {
  closed_ = true;
  changed_.notify_all();
}

void PageSession::read() {
  socket_.async_read(incoming_, [self = shared_from_this()](boost::beast::error_code failure, std::size_t) {
    if (failure) {
      self->stop();
      return;
    }
    self->receive(boost::beast::buffers_to_string(self->incoming_.data()));
    self->incoming_.clear();
    self->read();
  });
}

void PageSession::receive(std::string text) {
  auto request = parse_request(text);
  if (!request) return send_error(request.error());
  if (request->kind == PageRequest::Kind::values) values_ = request->on;
  if (request->kind == PageRequest::Kind::credit) {
    const std::lock_guard lock(mutex_);
    credit_ = true;
  }
  changed_.notify_all();
  if (auto done = perform(*request, world_); !done) send_error(done.error());
}

void PageSession::send(bool binary, std::shared_ptr<const std::string> bytes) {
  boost::asio::post(socket_.get_executor(), [weak = weak_from_this(), message = Message{binary, std::move(bytes)}] {
    const auto self = weak.lock();
    if (!self || self->closed_) return;
    self->outgoing_.push_back(message);
    if (self->outgoing_.size() > kMaxQueued) {
      boost::beast::get_lowest_layer(self->socket_).close();
      self->stop();
    } else if (self->outgoing_.size() == 1) {
      self->write_next();
    }
  });
}

void PageSession::write_next() {
  const Message& message = outgoing_.front();
  socket_.binary(message.binary);
  socket_.async_write(boost::asio::buffer(*message.bytes), [self = shared_from_this()](boost::beast::error_code failure, std::size_t) {
    if (failure) {
      self->stop();
      return;
    }
    self->outgoing_.pop_front();
    if (!self->outgoing_.empty()) self->write_next();
  });
}

void PageSession::send_error(const Error& error) {
  send(false, std::make_shared<std::string>(nlohmann::json{{"type", "error"}, {"message", error.text()}}.dump()));
}

void PageSession::send_status(WorldId world) {
  auto info = world_.client().world(world);
  if (!info) return;
  const WorldStatus& status = info->status;
  const nlohmann::json json{{"type", "status"}, {"world", status.name}, {"step", status.step}, {"time", status.time},
                            {"playing", status.state == WorldState::playing}, {"viewers", status.viewers},
                            {"factor", status.real_time_factor}};
  send(false, std::make_shared<std::string>(json.dump()));
}

void PageSession::watch() {
  while (!closed_) {
    if (const WorldId world = world_.id(); world != watched_) {
      watched_ = world;
      last_event_.reset();
    }
    if (watch_world(watched_)) continue;  // the world was replaced, or values were switched
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, milliseconds(500), [&] { return closed_.load(); });
  }
}

// True if another stream should be opened at once.
bool PageSession::watch_world(WorldId world) {
  const bool values = values_;
  auto stream = world_.client().watch(world, {.codec = Codec::quantised16, .compress = false, .values = values, .max_rate_hz = 60,
                                              .after_event = last_event_});
  if (!stream) {
    send_error(stream.error());
    return false;
  }
  send_status(world);
  auto status_sent = std::chrono::steady_clock::now();
  while (!closed_ && values_ == values) {
    auto update = (*stream)->next_encoded(milliseconds(100));
    if (!update) return world_.id() != world;
    if (const auto now = std::chrono::steady_clock::now(); now - status_sent > milliseconds(500)) {
      send_status(world);
      status_sent = now;
    }
    if (!*update) continue;
    if (const auto* topology = std::get_if<client::EncodedTopology>(&**update)) {
      send(true, topology->payload);
    } else if (const auto* frame = std::get_if<client::EncodedFrame>(&**update)) {
      {
        const std::lock_guard lock(mutex_);
        credit_ = false;
      }
      send(true, frame->payload);
      wait_for_credit();
    } else if (const auto* event = std::get_if<client::WorldEvent>(&**update)) {
      last_event_ = event->sequence;
      nlohmann::json json{{"type", "event"}, {"kind", client::to_string(event->kind)}, {"message", event->message},
                          {"body", event->body}, {"step", event->step}};
      if (!event->particles.empty()) {
        json["time"] = event->time;
        for (const float number : numbers_of(event->particles))
          json["particles"].push_back(std::isfinite(number) ? std::round(1e3 * number) / 1e3 : 0.0);  // millimetres
      }
      send(false, std::make_shared<std::string>(json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)));
    } else if (const auto* gap = std::get_if<EventGap>(&**update)) {
      last_event_ = gap->last;
      const nlohmann::json json{{"type", "event"}, {"kind", "gap"}, {"body", 0}, {"step", nullptr},
                                {"message", text("events ", gap->first, " to ", gap->last, " are lost")}};
      send(false, std::make_shared<std::string>(json.dump()));
    }
  }
  return true;
}

void PageSession::wait_for_credit() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return credit_ || closed_; });
}

}  // namespace crumple::viewer
