#pragma once

#include "common/error.h"
#include "server/grpc/simulation_service.h"

#include <grpcpp/server.h>

#include <memory>
#include <string>

namespace crumple::grpc_server {

struct ServerOptions {
  std::string listen = "127.0.0.1:50061";  // port 0: one that is free
  runtime::RegistryOptions registry;
  std::shared_ptr<const runtime::SceneLibrary> scenes;  // may be null
};

inline constexpr int kMaxRequestBytes = 64 << 20;  // of one message; larger ones end with RESOURCE_EXHAUSTED

// A server with its worlds, health service (also by the name "crumple.v1.SimulationService") and reflection. Plain
// text, no authentication: listen on loopback, or behind something that has both.
class SimulationServer {
 public:
  // Errors: invalid_argument if `listen` is not host:port; unavailable if it cannot listen there, also if another
  // server does.
  static Result<std::unique_ptr<SimulationServer>> start(ServerOptions options);
  ~SimulationServer();  // stops

  const std::string& address() const { return address_; }  // host:port it listens on
  runtime::WorldRegistry& registry() { return *registry_; }

  // Ends all worlds and streams with UNAVAILABLE, then waits for the calls: streams are cut after 1 s; a step that is
  // running and a world in the making are waited for. Once is enough.
  void stop();

 private:
  SimulationServer() = default;

  std::shared_ptr<const runtime::SceneLibrary> scenes_;
  std::unique_ptr<runtime::WorldRegistry> registry_;
  std::unique_ptr<SimulationService> service_;
  std::unique_ptr<grpc::Server> server_;
  std::string address_;
};

}  // namespace crumple::grpc_server
