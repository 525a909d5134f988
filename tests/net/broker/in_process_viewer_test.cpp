// The in-process viewer through which a publisher reads a server, and view-only servers.
#include "net/broker/in_process_viewer.h"

#include <boost/asio/post.hpp>
#include <optional>

#include "net/broker/broker_options.h"
#include "net/client/server_messages.h"
#include "tests/net/net_testing.h"

namespace brachy::net::test {
namespace {

struct InProcessViewerTest : ServerFixture {
  void adopt() {
    viewer = std::make_shared<InProcessViewer>(
        clock, "broker", kSubscribePoseHistory | kSubscribeScene | kSubscribePlan,
        [this](std::function<void()> f) { boost::asio::post(io, std::move(f)); },
        [this](const Bytes& header, const std::shared_ptr<const Bytes>& body) {
          Header decoded;
          ASSERT_TRUE(decode_header(header, 1 << 20, decoded).is_good());
          types.push_back(decoded.type);
          EXPECT_EQ(messages.take(decoded, *body), "");
          if (takes) boost::asio::post(io, [v = viewer] { v->done(); });
        },
        [this] { ++closed; });
    server->adopt_own(viewer);
  }
  std::shared_ptr<InProcessViewer> viewer;
  ServerMessages messages{{}};
  std::vector<MessageType> types;
  bool takes = true;
  int closed = 0;
};

TEST_F(InProcessViewerTest, GetsEverythingTakesNoPlaceAndNeedsNoToken) {
  ServerOptions options;
  options.max_clients = 1;
  options.tokens.add({}, {Role::kViewer});
  start(options);
  server->set_scene({});
  publish();
  adopt();
  ASSERT_TRUE(until([&] { return messages.frames() == 1; }));
  EXPECT_EQ(types, (std::vector{MessageType::kWelcome, MessageType::kTopology, MessageType::kScene,
                                MessageType::kFrame}));
  EXPECT_EQ(messages.mesh().positions(), simulation.state().mesh.deformed_vertices);
  EXPECT_EQ(server->client_count(), 0u);
  ClientOptions with_token;
  with_token.token = Token{};
  const auto client = join(with_token);
  ASSERT_TRUE(until([&] { return !client->states.empty(); }));
  EXPECT_EQ(client->states[0].clients, 1u);
  EXPECT_EQ(client->states[0].viewers, 1u);
  publish();
  ASSERT_TRUE(until([&] { return messages.frames() == 2; }));
  EXPECT_EQ(messages.mesh().positions(), simulation.state().mesh.deformed_vertices);
  viewer->leave();
  publish();
  ASSERT_TRUE(until([&] { return client->frames.size() > 1; }));
  EXPECT_EQ(messages.frames(), 2u);
  EXPECT_EQ(closed, 0) << "it left by itself";
}

TEST_F(InProcessViewerTest, IsNeverSilentButGetsNewerSnapshotsWhileItIsSlowAndIsClosedWhenItStalls) {
  ServerOptions options;
  options.ping_interval = std::chrono::milliseconds(20);
  options.silence_timeout = std::chrono::milliseconds(50);
  options.stall_timeout = std::chrono::milliseconds(400);
  options.state_interval = std::chrono::hours(1);
  start(options);
  publish();
  adopt();
  ASSERT_TRUE(until([&] { return messages.frames() == 1; }));
  pass(std::chrono::milliseconds(150));
  EXPECT_EQ(closed, 0);
  takes = false;
  for (int i = 0; i < 5; ++i) publish();
  ASSERT_TRUE(until([&] { return messages.frames() == 2; }));
  takes = true;
  viewer->done();
  ASSERT_TRUE(until([&] { return messages.mesh().tick() == simulation.state().summary.tick; }));
  EXPECT_LE(messages.frames(), 4u);
  takes = false;
  publish();
  pass(std::chrono::milliseconds(300));
  EXPECT_EQ(closed, 0);
  pass(std::chrono::milliseconds(150));
  EXPECT_EQ(closed, 1);
}

struct ShowingServerTest : ServerFixture {
  void SetUp() override {
    ServerOptions options;
    options.devices_at = "the daemon itself";
    start(options);
    publish();
  }
};

TEST_F(ShowingServerTest, ADeviceIsToldWhereToGo) {
  const auto device = join_as(Role::kDevice, "device");
  EXPECT_EQ(device->welcomes, 0);
  ASSERT_TRUE(until([&] { return !device->closed.empty(); }));
  ASSERT_EQ(device->errors.size(), 1u);
  EXPECT_TRUE(device->errors[0].fatal);
  EXPECT_EQ(device->errors[0].code, ErrorCode::kNotDevice);
  EXPECT_NE(device->errors[0].text.find("connect to the daemon itself"), std::string::npos);
  EXPECT_TRUE(devices.empty());
}

TEST_F(ShowingServerTest, AnOperatorIsAViewerAndIsTold) {
  const auto client = join_as(Role::kOperator, "operator");
  EXPECT_EQ(client->welcome.role, Role::kViewer);
  ASSERT_TRUE(until([&] { return !client->errors.empty(); }));
  EXPECT_FALSE(client->errors[0].fatal);
  EXPECT_EQ(client->errors[0].code, ErrorCode::kNotOperator);
  client->client.control({});
  client->client.arm(0);
  client->client.press(0, true);
  ASSERT_TRUE(until([&] { return client->errors.size() == 4; }));
  EXPECT_TRUE(controls.empty() && arms.empty() && drops.empty());
  EXPECT_TRUE(until([&] { return !client->frames.empty() && !client->states.empty(); }));
  EXPECT_EQ(client->states[0].viewers, 1u);
  EXPECT_TRUE(client->closed.empty());
}

TEST(BrokerOptions, UrlAndSessionAreChecked) {
  const auto refusal = [](const std::string& url, const std::string& session) -> std::string {
    try {
      BrokerOptions options;
      options.url = url;
      options.session = session;
      check_broker_options(options, "broker.url");
      return "";
    } catch (const UserError& error) {
      return error.what();
    }
  };
  const std::string good = refusal("nats://127.0.0.1:4222", "theatre-2");
  EXPECT_EQ(good.empty(), !nats_version().empty());
  EXPECT_EQ(good.find("install libnats-dev") != std::string::npos, nats_version().empty()) << good;
  for (const char* url : {"", "127.0.0.1", "http://127.0.0.1", "nats://", "nats://a,nats://b", "nats://a b"})
    EXPECT_NE(refusal(url, "s").find("broker.url is not the address of a broker"), std::string::npos) << url;
  for (const char* session : {"", "a.b", "a b", "*", ">", "ü"})
    EXPECT_NE(refusal("nats://h", session).find("letters, digits"), std::string::npos) << session;
  EXPECT_NE(refusal("nats://h", std::string(65, 's')).find("letters, digits"), std::string::npos);
}

TEST(BrokerOptions, ALogShowsNoPassword) {
  BrokerOptions options;
  options.url = "nats://anna:secret@host:4222";
  EXPECT_EQ(shown_url(options), "nats://host:4222");
  options.url = "tls://t@ken@host";
  EXPECT_EQ(shown_url(options), "tls://host");
  options.url = "nats://host";
  EXPECT_EQ(shown_url(options), "nats://host");
}

}  // namespace
}  // namespace brachy::net::test
