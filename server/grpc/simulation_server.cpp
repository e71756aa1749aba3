#include "server/grpc/simulation_server.h"

#include "common/frame_codec.h"
#include "common/text.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>

#include <chrono>
#include <cstdlib>
#include <mutex>

namespace crumple::grpc_server {
namespace {

// gRPC keeps these for the process.
void enable_plugins() {
  static std::once_flag once;
  std::call_once(once, [] {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  });
}

// "host:0" -> "host:port".
std::string with_port(const std::string& listen, int port) {
  const auto colon = listen.rfind(':');
  return colon == std::string::npos ? listen : text(listen.substr(0, colon), ":", port);
}

// gRPC takes a port modulo 65536; a number beyond it is a slip of the caller's.
bool port_in_range(const std::string& listen) {
  const std::string digits = listen.substr(listen.rfind(':') + 1);
  return digits.size() <= 5 && digits.find_first_not_of("0123456789") == std::string::npos && std::atoi(digits.c_str()) <= 65535;
}

}  // namespace

Result<std::unique_ptr<SimulationServer>> SimulationServer::start(ServerOptions options) {
  if (!port_in_range(options.listen)) {
    return std::unexpected(Error{ErrorCode::unavailable, "listen", text("is ", options.listen, ", must be host:port with a port up to 65535")});
  }
  enable_plugins();
  std::unique_ptr<SimulationServer> self(new SimulationServer);
  self->scenes_ = std::move(options.scenes);
  self->registry_ = std::make_unique<runtime::WorldRegistry>(std::move(options.registry));
  self->service_ = std::make_unique<SimulationService>(*self->registry_, self->scenes_.get());

  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(options.listen, grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(self->service_.get());
  builder.SetMaxReceiveMessageSize(kMaxRequestBytes);
  builder.SetMaxSendMessageSize(static_cast<int>(kMaxContentBytes) + (1 << 20));
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  // A client whose machine is gone says nothing: ask, so that its streams end within half a minute.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  self->server_ = builder.BuildAndStart();
  if (!self->server_ || port == 0)
    return std::unexpected(Error{ErrorCode::unavailable, "listen", text("is ", options.listen, ", cannot listen there")});
  self->server_->GetHealthCheckService()->SetServingStatus(v1::SimulationService::service_full_name(), true);
  self->address_ = with_port(options.listen, port);
  return self;
}

SimulationServer::~SimulationServer() { stop(); }

void SimulationServer::stop() {
  if (!server_) return;
  registry_->close({ErrorCode::unavailable, "", "the server is stopping"});
  server_->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(2));
  server_->Wait();
  server_.reset();
}

}  // namespace crumple::grpc_server
