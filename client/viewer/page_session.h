#pragma once

#include "client/viewer/page_command.h"
#include "client/viewer/viewed_world.h"

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace crumple::viewer {

// One page: a WebSocket. The socket lives on a strand; a thread of the session's own reads the world's stream and hands
// over topologies and frames as the frame codec writes them, and as JSON a status twice a second and events:
//   {"type": "event", "kind": ..., "body": id, "step": n, "message": ...}, of dust with "time" and "particles"; of kind "gap" if
//   events were lost
// The next frame is asked for when the page has granted a credit for it.
class PageSession : public std::enable_shared_from_this<PageSession> {
 public:
  using Socket = boost::beast::websocket::stream<boost::beast::tcp_stream>;

  PageSession(Socket socket, ViewedWorld& world);
  ~PageSession();

  void start();  // on the socket's strand, after the handshake
  void stop();   // from any thread
  void end();    // stops and waits for the stream's thread; when no other thread runs the socket any more

 private:
  struct Message {
    bool binary;
    std::shared_ptr<const std::string> bytes;
  };
  void read();
  void receive(std::string text);
  void send(bool binary, std::shared_ptr<const std::string> bytes);  // from any thread
  void write_next();

  void watch();                 // the stream's thread
  bool watch_world(WorldId world);
  void send_status(WorldId world);
  void send_error(const Error& error);
  void wait_for_credit();

  Socket socket_;
  ViewedWorld& world_;
  boost::beast::flat_buffer incoming_;
  std::deque<Message> outgoing_;
  std::thread watcher_;
  WorldId watched_ = 0;                      // the watcher's own
  std::optional<std::uint64_t> last_event_;  // of that world that the page has; its next stream goes on after it
  std::mutex mutex_;
  std::condition_variable changed_;
  bool credit_ = true;
  std::atomic<bool> values_ = false;
  std::atomic<bool> closed_ = false;
};

}  // namespace crumple::viewer
