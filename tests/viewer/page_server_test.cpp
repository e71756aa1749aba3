#include "client/viewer/page_server.h"

#include "client/sdk/in_process_client.h"
#include "common/stream_decoder.h"

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace crumple::viewer {
namespace {

namespace beast = boost::beast;
namespace http = boost::beast::http;
using boost::asio::ip::tcp;
using Json = nlohmann::json;

// A falling ball over a floor, served in process to a page server on a free port.
class PageServerTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("crumple_page_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_ / "assets");
    std::ofstream(folder_ / "index.html") << "<html>page</html>";
    std::ofstream(folder_ / "assets/main.js") << "let x = 1;";
    std::ofstream(folder_.string() + "_secret") << "secret";
    v1::Scene scene;
    auto* ball = scene.add_bodies();
    ball->set_name("ball");
    ball->mutable_pose()->mutable_position()->set_y(3);
    ball->mutable_rigid()->add_shapes()->mutable_sphere()->set_radius(0.5);
    for (const double time : {0.05, 0.3}) {
      auto* push = scene.add_script();
      push->set_time(time);
      auto* impulse = push->mutable_command()->mutable_apply_impulse();
      impulse->set_body("ball");
      impulse->mutable_impulse()->set_x(1);
    }
    auto world = client_->create_world(scene, "test");
    ASSERT_TRUE(world) << world.error().text();
    viewed_ = std::make_unique<ViewedWorld>(*client_, *world, "");
    auto server = PageServer::start("127.0.0.1", 0, PageFiles(folder_), *viewed_);
    ASSERT_TRUE(server) << server.error().text();
    server_ = std::move(*server);
  }
  void TearDown() override {
    server_.reset();
    std::filesystem::remove_all(folder_);
    std::filesystem::remove(folder_.string() + "_secret");
  }

  beast::tcp_stream connect() {
    beast::tcp_stream stream(io_);
    stream.connect(tcp::endpoint(boost::asio::ip::make_address("127.0.0.1"), server_->port()));
    return stream;
  }
  http::response<http::string_body> get(const std::string& target, http::verb verb = http::verb::get) {
    auto stream = connect();
    http::request<http::string_body> request(verb, target, 11);
    request.set(http::field::host, "127.0.0.1");
    http::write(stream, request);
    beast::flat_buffer buffer;
    http::response<http::string_body> response;
    http::read(stream, buffer, response);
    return response;
  }
  // A page's socket after its handshake.
  beast::websocket::stream<beast::tcp_stream> open_page() {
    beast::websocket::stream<beast::tcp_stream> page(connect());
    page.handshake("127.0.0.1", "/stream");
    return page;
  }
  // The next JSON message of a type, or the next binary one for "binary".
  std::string next(beast::websocket::stream<beast::tcp_stream>& page, const std::string& type) {
    for (int k = 0; k < 1000; ++k) {
      beast::flat_buffer buffer;
      page.read(buffer);
      const std::string text = beast::buffers_to_string(buffer.data());
      if (page.got_binary() ? type == "binary" : Json::parse(text)["type"] == type) return text;
    }
    ADD_FAILURE() << "no message of type " << type;
    return "";
  }
  void send(beast::websocket::stream<beast::tcp_stream>& page, const Json& json) {
    page.binary(false);
    page.write(boost::asio::buffer(json.dump()));
  }

  boost::asio::io_context io_;
  runtime::WorldRegistry registry_;
  std::unique_ptr<client::SimulationClient> client_ = client::in_process(registry_);
  std::filesystem::path folder_;
  std::unique_ptr<ViewedWorld> viewed_;
  std::unique_ptr<PageServer> server_;
};

TEST_F(PageServerTest, ServesItsFilesAndNothingElse) {
  EXPECT_EQ(get("/").body(), "<html>page</html>");
  EXPECT_EQ(get("/?x=1").body(), "<html>page</html>");
  const auto script = get("/assets/main.js");
  EXPECT_EQ(script.body(), "let x = 1;");
  EXPECT_EQ(script[http::field::content_type], "text/javascript");
  for (const std::string& target : {"/../" + folder_.filename().string() + "_secret", std::string("/etc/passwd"), std::string("/assets")}) {
    EXPECT_EQ(get(target).result(), http::status::not_found) << target;
  }
  EXPECT_EQ(get("/", http::verb::post).result(), http::status::method_not_allowed);
}

TEST_F(PageServerTest, APageGetsTopologyFrameAndStatus) {
  auto page = open_page();
  const Json status = Json::parse(next(page, "status"));
  EXPECT_EQ(status["world"], "test");
  StreamDecoder decoder;
  const auto topology = decoder.take_topology(next(page, "binary"));
  ASSERT_TRUE(topology) << topology.error().text();
  ASSERT_EQ(decoder.topology().bodies.size(), 1u);
  EXPECT_EQ(decoder.topology().bodies[0].name, "ball");
  const auto frame = decoder.decode_frame(next(page, "binary"));
  ASSERT_TRUE(frame) << frame.error().text();
  EXPECT_NEAR(frame->bodies[0].pose.p_WB.y(), 3, 1e-6);
}

TEST_F(PageServerTest, APageStepsAndPushes) {
  auto page = open_page();
  StreamDecoder decoder;
  ASSERT_TRUE(decoder.take_topology(next(page, "binary")));
  next(page, "binary");  // frame of step 0
  send(page, {{"type", "push"}, {"body", 0}, {"point", {0, 3, 0}}, {"impulse", {1000, 0, 0}}});
  send(page, {{"type", "step"}, {"count", 10}});
  send(page, {{"type", "credit"}});
  const auto frame = decoder.decode_frame(next(page, "binary"));
  ASSERT_TRUE(frame);
  EXPECT_GT(frame->step, 0u);
  EXPECT_GT(frame->bodies[0].pose.p_WB.x(), 0.001);
}

// A page that asks for values gets another stream, which goes on where the one before ended.
TEST_F(PageServerTest, EventsNameTheirBodyAndStepAndComeOnceEvenIfValuesAreSwitched) {
  auto page = open_page();
  next(page, "status");
  send(page, {{"type", "step"}, {"count", 10}});
  send(page, {{"type", "credit"}});
  const Json first = Json::parse(next(page, "event"));
  EXPECT_EQ(first["kind"], "script");
  EXPECT_EQ(first["body"], 0);
  EXPECT_LE(first["step"], 10);
  send(page, {{"type", "values"}, {"on", true}});
  send(page, {{"type", "step"}, {"count", 200}});
  for (int k = 0; k < 4; ++k) send(page, {{"type", "credit"}});
  const Json second = Json::parse(next(page, "event"));
  EXPECT_EQ(second["kind"], "script");
  EXPECT_GT(second["step"], 10);
}

TEST_F(PageServerTest, ABadRequestIsAnsweredAndTheStreamGoesOn) {
  auto page = open_page();
  StreamDecoder decoder;
  ASSERT_TRUE(decoder.take_topology(next(page, "binary")));
  send(page, {{"type", "explode"}});
  EXPECT_NE(Json::parse(next(page, "error"))["message"].get<std::string>().find("type"), std::string::npos);
  send(page, {{"type", "push"}, {"body", 7}, {"point", {0, 0, 0}}, {"impulse", {1, 0, 0}}});
  EXPECT_NE(Json::parse(next(page, "error"))["message"].get<std::string>().find("body is 7"), std::string::npos);
  send(page, {{"type", "step"}, {"count", 1}});
  send(page, {{"type", "credit"}});
  EXPECT_TRUE(decoder.decode_frame(next(page, "binary")));
}

TEST_F(PageServerTest, APageOfAnotherOriginIsRefused) {
  beast::websocket::stream<beast::tcp_stream> page(connect());
  page.set_option(beast::websocket::stream_base::decorator([](beast::websocket::request_type& request) {
    request.set(http::field::origin, "http://elsewhere.example");
  }));
  beast::error_code failure;
  page.handshake("127.0.0.1", "/stream", failure);
  EXPECT_TRUE(failure);
}

TEST_F(PageServerTest, APageThatVanishesCostsNothing) {
  for (int k = 0; k < 5; ++k) {
    auto page = open_page();
    next(page, "binary");
    beast::get_lowest_layer(page).close();
  }
  auto page = open_page();
  EXPECT_TRUE(StreamDecoder().take_topology(next(page, "binary")));
}

}  // namespace
}  // namespace crumple::viewer
