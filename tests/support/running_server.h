#pragma once

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>

#include "client/sdk/simulation_client.h"
#include "server/grpc/simulation_server.h"

// A real server on a free loopback port, and a scene small enough for tests.
namespace crumple::test {

inline constexpr std::chrono::seconds kDeadline{20};  // generous: it only passes when something hangs

inline std::unique_ptr<grpc_server::SimulationServer> start_server(grpc_server::ServerOptions options = {}) {
  options.listen = "127.0.0.1:0";
  auto server = grpc_server::SimulationServer::start(std::move(options));
  EXPECT_TRUE(server) << server.error().text();
  return server ? *std::move(server) : nullptr;
}

inline std::unique_ptr<client::SimulationClient> connect_to(const grpc_server::SimulationServer& server) {
  auto client = client::connect(server.address(), {.connect_timeout = kDeadline, .call_timeout = kDeadline});
  EXPECT_TRUE(client) << client.error().text();
  return client ? *std::move(client) : nullptr;
}

// A box that falls on the ground beside a soft cube that does the same.
inline v1::Scene small_scene() {
  v1::Scene scene;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(R"(
      name: "small"
      bodies { name: "ground" rigid { kind: FIXED shapes { plane { normal { y: 1 } } } } }
      bodies { name: "box" pose { position { y: 0.7 } } rigid { shapes { box {} } } }
      bodies { name: "cube" pose { position { x: 3 y: 0.6 } }
               fem { mesh { box { cells { x: 1 y: 1 z: 1 } } } material { young: 1e6 } } })", &scene));
  return scene;
}

}  // namespace crumple::test
