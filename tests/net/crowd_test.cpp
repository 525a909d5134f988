// Many peers that come and go in a burst: what one does never ends another's session.
#include <algorithm>

#include "net/session/notice_queue.h"
#include "tests/net/net_testing.h"
#include "tests/net/raw_peer.h"

namespace brachy::net::test {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

EventMessage notice(std::uint16_t needle, const std::string& text) {
  return {EventKind::kDeviceAttached, needle, 0, text};
}

TEST(NoticeQueue, PassesABurstAndThenTheNewestOfEachKey) {
  std::vector<std::string> passed;
  std::uint64_t counted = 0;
  NoticeQueue notices(4, 16, [&](const EventMessage& event, std::uint64_t count) {
    passed.push_back(event.text);
    counted += count;
  });
  for (int i = 0; i < 500; ++i) notices.add("1", notice(1, std::to_string(i)), kSecond);
  EXPECT_EQ(passed.size(), 16u);
  notices.add("2", notice(2, "other needle"), kSecond);
  EXPECT_EQ(passed.size(), 16u);
  notices.update(2 * kSecond);
  ASSERT_EQ(passed.size(), 18u);
  EXPECT_EQ(passed[16], "499");
  EXPECT_EQ(passed[17], "other needle");
  EXPECT_EQ(counted, 501u);
  notices.update(100 * kSecond);
  EXPECT_EQ(passed.size(), 18u);
}

struct CrowdTest : ServerFixture {
  void start_with_two_needles() {
    ServerOptions options;
    options.needles = 2;
    start(options);
    viewer = join_as(Role::kViewer, "viewer");
    the_operator = join_as(Role::kOperator, "operator");
    device = join_as(Role::kDevice, "touch");
    ASSERT_EQ(device->welcome.needle, 0);
  }
  std::vector<Recorder*> rightful() const { return {viewer.get(), the_operator.get(), device.get()}; }
  /// The last notice about needle 1 tells that it was left.
  static bool knows_that_it_is_free(const Recorder& client) {
    const auto last = std::find_if(client.events.rbegin(), client.events.rend(),
                                   [](const EventMessage& event) { return event.needle == 1; });
    return last != client.events.rend() && last->kind == EventKind::kDeviceDetached;
  }

  std::unique_ptr<Recorder> viewer, the_operator, device;
};

TEST_F(CrowdTest, ABurstOfAttachesEndsNobodysSession) {
  start_with_two_needles();
  DeviceInfo other;
  other.name = "hasty";
  other.address = "127.0.0.3:1";
  other.needle = 1;
  for (int i = 0; i < 300; ++i) {  // nothing is sent in between
    ASSERT_FALSE(server->attach(other));
    server->detach(1, "reset by peer");
    server->send(0, ForceMessage{});
  }
  for (Recorder* client : rightful()) {
    EXPECT_TRUE(until([&] { return knows_that_it_is_free(*client); }));
    EXPECT_TRUE(client->closed.empty()) << client->closed.front();
    EXPECT_LT(client->events.size(), 40u);
  }
  EXPECT_TRUE(until([&] { return !device->forces.empty(); }));
  EXPECT_EQ(server->client_count(), 3u);
}

TEST_F(CrowdTest, PeersThatAttachAndVanishOverSocketsEndNobodysSession) {
  start_with_two_needles();
  for (int burst = 0; burst < 8; ++burst) {
    for (int i = 0; i < 40; ++i) {
      RawPeer peer(io, server->port(), 0, {}, "127.0.0.3");
      peer.hello(Role::kDevice);
      peer.close();
    }
    server->send(0, ForceMessage{});
    ASSERT_TRUE(until([&] { return device->forces.size() > static_cast<std::size_t>(burst); }));
  }
  ASSERT_TRUE(until([&] { return server->client_count() == 3; }));
  for (Recorder* client : rightful()) {
    EXPECT_TRUE(until([&] { return knows_that_it_is_free(*client); }));
    EXPECT_TRUE(client->closed.empty()) << client->closed.front();
  }
}

TEST_F(CrowdTest, EventsForAClientThatIsBehindAreDroppedAndCountedSafetyLast) {
  ServerOptions options;
  options.send_buffer_bytes = 4096;
  start(options);
  const auto good = join_as(Role::kViewer, "good");
  RawPeer behind(io, server->port(), 4096);
  behind.hello(Role::kViewer, kSubscribeNoMesh);
  ASSERT_TRUE(until([&] { return server->role_counts().viewers == 2; }));
  const std::string text(480, 'x');
  std::size_t sent = 1;
  // As many as fill its buffers, and more.
  for (; sent < 600; ++sent) {
    server->broadcast(EventMessage{sent == 300 ? EventKind::kSafety : EventKind::kNote, 0, sent, text});
    ASSERT_TRUE(until_at_once([&] { return good->events.size() == sent; }));
  }
  EXPECT_EQ(server->client_count(), 2u);
  const std::uint64_t dropped = server->state().events_dropped;
  EXPECT_GT(dropped, 100u);
  ASSERT_TRUE(until_at_once([&] {
    behind.take();
    return !behind.events.empty() && behind.events.back().tick == sent - 1;
  }));
  EXPECT_EQ(behind.events.size() + dropped, sent - 1);
  EXPECT_TRUE(std::any_of(behind.events.begin(), behind.events.end(),
                          [](const EventMessage& event) { return event.kind == EventKind::kSafety; }));
  behind.send_message(PingMessage{});
  behind.states.clear();
  ASSERT_TRUE(until([&] {
    behind.take();
    return !behind.states.empty();
  }));
  EXPECT_EQ(behind.states.back().events_dropped, dropped);
  EXPECT_EQ(good->states.empty() ? 0 : good->states.back().events_dropped, 0u);
}

}  // namespace
}  // namespace brachy::net::test
