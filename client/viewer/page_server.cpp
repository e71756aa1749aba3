#include "client/viewer/page_server.h"

#include "client/viewer/page_session.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <chrono>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace crumple::viewer {

namespace beast = boost::beast;
namespace http = boost::beast::http;
using boost::asio::ip::tcp;

namespace {

constexpr std::chrono::seconds kRequestTimeout{20};
constexpr int kThreads = 2;
constexpr std::size_t kMaxPages = 64;

// A browser sends Origin; other programs need not.
bool origin_allowed(const http::request<http::string_body>& request) {
  const auto origin = request.find(http::field::origin);
  if (origin == request.end()) return true;
  const std::string own = "http://" + std::string(request[http::field::host]);
  return origin->value() == own;
}

}  // namespace

struct PageServer::Impl {
  Impl(PageFiles page, ViewedWorld& viewed) : files(std::move(page)), world(viewed), acceptor(io) {}

  PageFiles files;
  ViewedWorld& world;
  boost::asio::io_context io{kThreads};
  tcp::acceptor acceptor;
  std::vector<std::thread> threads;
  std::mutex mutex;
  std::vector<std::weak_ptr<PageSession>> sessions;

  // One HTTP connection until it ends or becomes a WebSocket.
  struct Connection : std::enable_shared_from_this<Connection> {
    Connection(tcp::socket socket, Impl& s) : stream(std::move(socket)), server(s) {}
    beast::tcp_stream stream;
    Impl& server;
    beast::flat_buffer buffer;
    http::request<http::string_body> request;
    http::response<http::string_body> response;
    std::unique_ptr<PageSession::Socket> socket;

    void read() {
      request = {};
      stream.expires_after(kRequestTimeout);
      http::async_read(stream, buffer, request, [self = shared_from_this()](beast::error_code failure, std::size_t) {
        if (!failure) self->answer();
      });
    }
    void answer() {
      const std::string target(request.target());
      if (target == "/stream" && beast::websocket::is_upgrade(request)) return upgrade();
      response = {};
      response.version(request.version());
      response.keep_alive(request.keep_alive());
      const PageFile* file = server.files.find(target);
      if (request.method() != http::verb::get) {
        response.result(http::status::method_not_allowed);
      } else if (!file) {
        response.result(http::status::not_found);
        response.body() = "no such file\n";
      } else {
        response.set(http::field::content_type, file->type);
        response.set(http::field::cache_control, "no-cache");
        response.body() = file->bytes;
      }
      write();
    }
    void write() {
      response.prepare_payload();
      http::async_write(stream, response, [self = shared_from_this()](beast::error_code failure, std::size_t) {
        if (!failure && self->response.keep_alive()) self->read();
      });
    }
    void upgrade() {
      if (!origin_allowed(request) || !server.has_room()) {
        response = {};
        response.result(origin_allowed(request) ? http::status::service_unavailable : http::status::forbidden);
        response.keep_alive(false);
        return write();
      }
      stream.expires_never();
      socket = std::make_unique<PageSession::Socket>(std::move(stream));
      socket->set_option(beast::websocket::stream_base::timeout::suggested(beast::role_type::server));
      socket->async_accept(request, [self = shared_from_this()](beast::error_code failure) {
        if (failure) return;
        auto session = std::make_shared<PageSession>(std::move(*self->socket), self->server.world);
        self->server.keep(session);
        session->start();
      });
    }
  };

  bool has_room() {
    const std::lock_guard lock(mutex);
    std::erase_if(sessions, [](const auto& session) { return session.expired(); });
    return sessions.size() < kMaxPages;
  }
  void keep(const std::shared_ptr<PageSession>& session) {
    const std::lock_guard lock(mutex);
    sessions.push_back(session);
  }
  void accept() {
    acceptor.async_accept(boost::asio::make_strand(io), [this](beast::error_code failure, tcp::socket socket) {
      if (!acceptor.is_open()) return;
      if (!failure) std::make_shared<Connection>(std::move(socket), *this)->read();
      accept();
    });
  }
};

PageServer::PageServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<PageServer>> PageServer::start(const std::string& host, std::uint16_t port, PageFiles files, ViewedWorld& world) {
  auto impl = std::make_unique<Impl>(std::move(files), world);
  beast::error_code failure;
  const auto address = boost::asio::ip::make_address(host, failure);
  if (failure) return invalid("listen", "is " + host + ", must be an IP address");
  const tcp::endpoint endpoint(address, port);
  impl->acceptor.open(endpoint.protocol(), failure);
  if (!failure) impl->acceptor.set_option(boost::asio::socket_base::reuse_address(true), failure);
  if (!failure) impl->acceptor.bind(endpoint, failure);
  if (!failure) impl->acceptor.listen(boost::asio::socket_base::max_listen_connections, failure);
  if (failure) return std::unexpected(Error{ErrorCode::unavailable, "listen", host + ":" + std::to_string(port) + " cannot be had: " + failure.message()});
  impl->accept();
  for (int t = 0; t < kThreads; ++t) impl->threads.emplace_back([io = &impl->io] { io->run(); });
  return std::unique_ptr<PageServer>(new PageServer(std::move(impl)));
}

PageServer::~PageServer() {
  impl_->io.stop();
  for (std::thread& thread : impl_->threads) thread.join();
  for (const auto& weak : impl_->sessions) {
    if (const auto session = weak.lock()) session->end();
  }
}

std::uint16_t PageServer::port() const { return impl_->acceptor.local_endpoint().port(); }

}  // namespace crumple::viewer
