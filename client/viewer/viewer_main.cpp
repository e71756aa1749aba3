// crumple-viewer: a thin client that turns a world's stream into a page.
#include "client/viewer/page_server.h"

#include <CLI/CLI.hpp>

#include <csignal>
#include <iostream>

using namespace crumple;

int main(int argc, char** argv) {
  CLI::App app{"Shows one world of a crumple-server as a page: frames in by gRPC, out over HTTP and WebSocket."};
  std::string server = "127.0.0.1:50061", listen = "127.0.0.1", scene, web = CRUMPLE_WEB_DIR;
  std::uint16_t port = 8080;
  WorldId world = 0;
  app.add_option("--server", server, "address of the crumple-server")->capture_default_str();
  app.add_option("--listen", listen, "address of this machine to serve the page on")->capture_default_str();
  app.add_option("--port", port, "port of the page; 0: any free one, printed")->capture_default_str();
  app.add_option("--web", web, "folder of the built page")->capture_default_str();
  auto* which = app.add_option_group("world", "what to show; nothing: the server's first world");
  which->add_option("--world", world, "number of a running world");
  which->add_option("--scene", scene, "scene file in the server's folder: makes a world and plays it; the page can restart it");
  which->require_option(0, 1);
  CLI11_PARSE(app, argc, argv);

  // Signals are for the waiting main thread alone.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  const auto fail = [](const Error& error) {
    std::cerr << "crumple-viewer: " << error.text() << "\n";
    return error.code == ErrorCode::invalid_argument ? 2 : 1;
  };
  viewer::PageFiles files(web);
  if (!files.find("/")) return fail({ErrorCode::invalid_argument, "--web", "is " + web + ", which holds no built page"});
  auto client = client::connect(server);
  if (!client) return fail(client.error());
  if (!scene.empty()) {
    auto made = (*client)->create_world_from_file(scene);
    if (!made) return fail(made.error());
    world = *made;
    if (auto playing = (*client)->play(world); !playing) return fail(playing.error());
  } else if (world == 0) {
    auto worlds = (*client)->list_worlds();
    if (!worlds) return fail(worlds.error());
    if (worlds->empty()) return fail({ErrorCode::not_found, "", "the server has no world; name one with --scene"});
    world = worlds->front().id;
  }
  viewer::ViewedWorld viewed(**client, world, scene);
  auto page = viewer::PageServer::start(listen, port, std::move(files), viewed);
  if (!page) return fail(page.error());
  std::cout << "page: http://" << listen << ":" << (*page)->port() << "/\n" << std::flush;

  int caught = 0;
  sigwait(&signals, &caught);
  return 0;
}
