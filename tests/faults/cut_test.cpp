// Conversations cut at every byte, in either direction and in every way that a connection can end: the server releases
// everything, and serves the next client.
#include <sys/resource.h>

#include <algorithm>
#include <string>

#include "net/igtl/codec/codec.h"
#include "tests/faults/fault_proxy.h"
#include "tests/faults/faults_testing.h"
#include "tests/net/http/websocket_peer.h"

namespace brachy::test {
namespace {

using net::Bytes;
using net::Role;
using net::ServerOptions;

enum class Protocol { kNative, kWebSocket, kHttp, kIgtl };

Bytes bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

/// What a client of this protocol sends. `number`: a device's needle.
std::vector<Bytes> parts_of(Protocol protocol, Role role, std::uint16_t number, std::uint16_t port) {
  if (protocol == Protocol::kHttp) {
    const std::string rest = " / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n\r\n";
    return {bytes_of("HEAD" + rest), bytes_of("GET" + rest)};
  }
  if (protocol == Protocol::kIgtl) {
    const std::string tool = role == Role::kDevice ? "Needle" + std::to_string(number) : "Probe";
    const Bytes pose = net::igtl::encode_transform({1, tool + "ToRas", 1}, RigidTransform{});
    return {net::igtl::encode_empty("GET_STATUS", {1, "", 0}), pose, pose};
  }
  std::vector<Bytes> messages(5);
  net::HelloMessage hello;
  hello.role = role;
  hello.name = "cut";
  net::PoseMessage pose;
  pose.needle = number;
  std::uint64_t sequence = 0;
  if (role == Role::kDevice) hello.needle = number;
  net::encode(hello, ++sequence, 1, messages[0]);
  net::encode(net::PingMessage{}, ++sequence, 1, messages[1]);
  net::encode(pose, ++sequence, 1, messages[2]);
  net::encode(net::DropMessage{number, true}, ++sequence, 1, messages[3]);
  net::encode(net::PingMessage{}, ++sequence, 1, messages[4]);
  const bool is_framed = protocol == Protocol::kWebSocket;
  std::vector<Bytes> parts(2);
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const Bytes sent =
        is_framed ? net::test::websocket_frame(net::test::Opcode::kBinary, messages[i]) : messages[i];
    parts[std::min<std::size_t>(i, 1)].insert(parts[std::min<std::size_t>(i, 1)].end(), sent.begin(),
                                              sent.end());
  }
  if (is_framed) parts.insert(parts.begin(), bytes_of(net::test::upgrade_request(port)));
  return parts;
}

struct Case {
  const char* name;
  Protocol protocol;
  Role role;
};

struct CutTest : FaultsFixture, ::testing::WithParamInterface<std::tuple<Case, Cut>> {
  static constexpr std::size_t kBatch = 400;  // connections at once; each has four descriptors here

  void SetUp() override {
    rlimit limit{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 4096);
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
    tissue = net::test::line_tissue(2);
    simulation = net::test::FakeSimulation(tissue);
    ServerOptions options = short_timeouts();
    options.hello_timeout = options.silence_timeout = options.stall_timeout = std::chrono::milliseconds(150);
    options.ping_interval = std::chrono::milliseconds(50);
    start_all(options);
    publish_all();
    proxy.emplace(io, clock, server_port());
    // One-time allocations of this process are done by now.
    expect_a_good_client_is_served();
    descriptors = open_descriptors();
  }
  std::uint16_t server_port() const {
    const Protocol protocol = std::get<0>(GetParam()).protocol;
    return protocol == Protocol::kHttp || protocol == Protocol::kWebSocket ? http->port()
           : protocol == Protocol::kIgtl                                   ? igtl->port()
                                                                           : server->port();
  }
  std::shared_ptr<Talker> talk(std::uint16_t number) {
    const auto [name, protocol, role] = std::get<0>(GetParam());
    auto talker =
        std::make_shared<Talker>(io, proxy->port(), parts_of(protocol, role, number, proxy->port()));
    talker->start();
    return talker;
  }
  /// How long either direction of a conversation is: until everything was said, and a frame has come.
  std::pair<std::uint64_t, std::uint64_t> lengths() {
    std::uint64_t up = 0;
    for (const Bytes& part :
         parts_of(std::get<0>(GetParam()).protocol, std::get<0>(GetParam()).role, 0, proxy->port()))
      up += part.size();
    const auto talker = talk(0);
    EXPECT_TRUE(until_ticked([&] { return talker->has_said_all() && proxy->passed_up(0) == up; }));
    const std::uint64_t said = proxy->passed_down(0);
    if (std::get<0>(GetParam()).protocol != Protocol::kHttp) {
      EXPECT_TRUE(until_ticked([&] { return proxy->passed_down(0) > said; }));
    }
    const std::uint64_t down = proxy->passed_down(0);
    talker->close();
    EXPECT_TRUE(until_ticked([&] { return sessions() == 0 && has_no_lease(); }));
    proxy->clear();
    return {up, down};
  }

  /// Lists the open descriptors, thousands, only where time has passed.
  bool closes_down_to(std::size_t count) {
    std::int64_t listed_ns = 0;
    return until_ticked([&] {
      return std::exchange(listed_ns, clock.now_ns()) != clock.now_ns() && open_descriptors() <= count;
    });
  }

  /// Connections that are cut after `first`, `first` + 1, … bytes.
  void cut_batch(bool is_up, std::uint64_t first, std::size_t count) {
    const Cut cut = std::get<1>(GetParam());
    proxy->plan = [&](std::size_t number) {
      Faults faults;
      faults.cut = cut;
      faults.receive_buffer = 4096;
      (is_up ? faults.up : faults.down).cut_after = first + number;
      return faults;
    };
    std::vector<std::shared_ptr<Talker>> talkers;
    for (std::size_t i = 0; i < count; ++i) {
      talkers.push_back(talk(static_cast<std::uint16_t>(i)));
      ASSERT_TRUE(until_at_once([&] { return proxy->count() > i; }));
    }
    // The server has released them, although the peers' ends may still be open.
    const std::size_t others = descriptors + 3 * count;
    ASSERT_TRUE(until_ticked([&] { return sessions() == 0 && has_no_lease(); }))
        << sessions() << " sessions left";
    ASSERT_TRUE(closes_down_to(others)) << open_descriptors() - others << " descriptors left";
    if (cut != Cut::kSilence) {
      ASSERT_TRUE(until_ticked([&] {
        return std::ranges::all_of(talkers, [](const auto& talker) { return talker->is_ended(); });
      }));
    }
    for (const auto& talker : talkers) talker->close();
    talkers.clear();
    proxy->clear();
    ASSERT_TRUE(closes_down_to(descriptors));
    EXPECT_EQ(open_descriptors(), descriptors);
  }

  std::optional<FaultProxy> proxy;
  std::size_t descriptors = 0;
};

TEST_P(CutTest, AtEveryByteLeavesNothingBehind) {
  const auto [up, down] = lengths();
  ASSERT_GT(up, 50u);
  ASSERT_GT(down, 50u);
  for (const bool is_up : {true, false}) {
    const std::uint64_t length = is_up ? up : down;
    for (std::uint64_t first = 0; first < length; first += kBatch)
      ASSERT_NO_FATAL_FAILURE(cut_batch(is_up, first, std::min<std::uint64_t>(kBatch, length - first)))
          << (is_up ? "up" : "down") << " from byte " << first << " of " << length;
  }
  expect_a_good_client_is_served();
}

constexpr Case kCases[] = {
    {"Viewer", Protocol::kNative, Role::kViewer},  {"Device", Protocol::kNative, Role::kDevice},
    {"Page", Protocol::kWebSocket, Role::kViewer}, {"PageOfADevice", Protocol::kWebSocket, Role::kDevice},
    {"Http", Protocol::kHttp, Role::kViewer},      {"Slicer", Protocol::kIgtl, Role::kViewer},
    {"Tracker", Protocol::kIgtl, Role::kDevice}};

const char* name_of(Cut cut) {
  return cut == Cut::kClose ? "Closed" : cut == Cut::kReset ? "Reset" : "Silent";
}
constexpr Cut kCuts[] = {Cut::kClose, Cut::kReset, Cut::kSilence};

INSTANTIATE_TEST_SUITE_P(Every, CutTest,
                         ::testing::Combine(::testing::ValuesIn(kCases), ::testing::ValuesIn(kCuts)),
                         [](const auto& given) {
                           return std::get<0>(given.param).name +
                                  std::string(name_of(std::get<1>(given.param)));
                         });

/// The client's side: a Client that is cut off at any byte reports it once, and its mesh is never wrong.
struct CutClientTest : FaultsFixture, ::testing::WithParamInterface<Cut> {};

TEST_P(CutClientTest, AtEveryByteIsToldOnceAndShowsNoWrongMesh) {
  tissue = net::test::line_tissue(2);
  simulation = net::test::FakeSimulation(tissue);
  start_all();
  publish_all();
  FaultProxy proxy(io, clock, server->port());
  net::ClientOptions options;
  options.silence_timeout = std::chrono::milliseconds(200);
  options.ping_interval = std::chrono::milliseconds(50);
  const auto join_through = [&] {
    auto recorder = std::make_unique<net::test::Recorder>(io, on_clock(options));
    recorder->client.connect("127.0.0.1", proxy.port());
    return recorder;
  };
  std::uint64_t length = 0;
  {
    const auto whole = join_through();
    ASSERT_TRUE(until([&] { return whole->frames.size() == 1; }));
    length = proxy.passed_down(0);
  }
  proxy.clear();
  ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  const auto positions = simulation.state().mesh.deformed_vertices;
  for (std::uint64_t first = 0; first < length; first += 400) {
    proxy.clear();
    proxy.plan = [&, first](std::size_t number) {
      return Faults{.up = {}, .down = {.cut_after = first + number}, .cut = GetParam()};
    };
    std::vector<std::unique_ptr<net::test::Recorder>> clients;
    for (std::uint64_t i = first; i < std::min(length, first + 400); ++i) clients.push_back(join_through());
    ASSERT_TRUE(until([&] {
      return std::ranges::all_of(clients, [](const auto& client) { return !client->closed.empty(); });
    }));
    for (const auto& client : clients) {
      EXPECT_EQ(client->closed.size(), 1u);
      EXPECT_FALSE(client->closed[0].empty());
      EXPECT_FALSE(client->client.is_open());
      if (client->frames.empty()) continue;
      EXPECT_EQ(client->client.mesh().positions(), positions);
    }
    clients.clear();
    proxy.clear();
    ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  }
  expect_a_good_client_is_served();
}

INSTANTIATE_TEST_SUITE_P(Every, CutClientTest, ::testing::ValuesIn(kCuts),
                         [](const auto& given) { return std::string(name_of(given.param)); });

}  // namespace
}  // namespace brachy::test
