#pragma once

#include "client/viewer/page_files.h"
#include "client/viewer/viewed_world.h"

#include <cstdint>
#include <memory>
#include <string>

namespace crumple::viewer {

// HTTP and WebSocket for pages: the page's files, and "/stream", one PageSession a page. A browser only gets the stream
// from a page of this server's own (Origin must name the host asked for).
class PageServer {
 public:
  // host: an address of this machine; port 0: any free one. Error unavailable: the port cannot be had.
  static Result<std::unique_ptr<PageServer>> start(const std::string& host, std::uint16_t port, PageFiles files, ViewedWorld& world);
  ~PageServer();  // ends all sessions

  std::uint16_t port() const;

 private:
  struct Impl;
  explicit PageServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crumple::viewer
