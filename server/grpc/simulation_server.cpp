#include "server/grpc/simulation_server.h"

#include "common/frame_codec.h"
#include "common/text.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>

#include <charconv>
#include <chrono>
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

// Where the port begins in "host:port". gRPC takes ports beyond 65535 modulo 65536, hence the check.
Result<std::size_t> port_position(const std::string& listen) {
  const std::size_t position = listen.rfind(':') + 1;  // 0: no colon
  int port = -1;
  const char* end = listen.data() + listen.size();
  const auto [parsed, error] = std::from_chars(listen.data() + position, end, port);
  if (position < 2 || error != std::errc() || parsed != end || port < 0 || port > 65535)
    return invalid("listen", text("is \"", listen, "\", must be host:port with a port in [0, 65535]"));
  return position;
}

}  // namespace

Result<std::unique_ptr<SimulationServer>> SimulationServer::start(ServerOptions options) {
  const Result<std::size_t> port_at = port_position(options.listen);
  if (!port_at) return std::unexpected(port_at.error());
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
  self->address_ = text(options.listen.substr(0, *port_at), port);
  return self;
}

SimulationServer::~SimulationServer() { stop(); }

void SimulationServer::stop() {
  if (!server_) return;
  registry_->close({ErrorCode::unavailable, "", "the server is stopping"});
  server_->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(1));
  server_->Wait();
  server_.reset();
}

}  // namespace crumple::grpc_server
