// Viewers behind `brachy relay`: brachyd, a real nats-server, relays and viewers, any of which is killed.
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <cmath>
#include <csignal>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "net/broker/chunks.h"
#include "net/broker/nats_link.h"
#include "test_paths.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/http_get.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"
#include "tests/net/http/websocket_peer.h"

namespace brachy {
namespace {

using namespace brachy::test;

std::uint16_t free_port() {
  boost::asio::io_context io;
  using boost::asio::ip::tcp;
  return tcp::acceptor(io, {boost::asio::ip::make_address("127.0.0.1"), 0}).local_endpoint().port();
}

/// A nats-server on a fixed port, also after it was killed.
class Broker {
 public:
  Broker() { start(); }
  void start() {
    process_.emplace(
        std::vector<std::string>{NATS_SERVER_BINARY, "-a", "127.0.0.1", "-p", std::to_string(port_)});
    ASSERT_TRUE(process_->says("Server is ready"));
  }
  void kill() {
    process_->send_signal(SIGKILL);
    process_->wait();
    process_.reset();
  }
  void send_signal(int number) { process_->send_signal(number); }
  std::string url() const { return "nats://127.0.0.1:" + std::to_string(port_); }

 private:
  const std::uint16_t port_ = free_port();
  std::optional<ChildProcess> process_;
};

/// `brachy relay`, whose first line was read.
class Relay {
 public:
  explicit Relay(const Broker& broker, std::uint16_t at = 0) : process(line(broker, at)) {}
  bool listens() {
    const auto first = process.read_line();
    constexpr std::string_view kSays = "brachy relay listening on 127.0.0.1:";
    if (!first || !first->starts_with(kSays)) return false;
    port = static_cast<std::uint16_t>(std::stoi(first->substr(kSays.size())));
    return true;
  }
  ChildProcess process;
  std::uint16_t port = 0;

 private:
  static std::vector<std::string> line(const Broker& broker, std::uint16_t at) {
    return brachy_line({"relay", "--nats", broker.url(), "--port", std::to_string(at), "--http-port", "0",
                        "--duration", std::to_string(kDeadline / std::chrono::seconds(1)), "--json"});
  }
};

struct RelayTest : ::testing::Test {
  void SetUp() override {
    if (net::nats_version().empty()) GTEST_SKIP() << "built without libnats-dev";
    if (std::string(NATS_SERVER_BINARY).empty()) GTEST_SKIP() << "nats-server is not installed";
    broker.emplace();
    scene = folder.write("scene.toml", small_scene("[broker]\nurl = \"" + broker->url() + "\"\n"));
  }
  std::vector<std::string> needle() const { return {"--trajectory", insertion, "--play"}; }

  const TempFolder folder;
  std::optional<Broker> broker;
  std::string scene;
  std::string insertion = folder.write("insertion.csv", short_insertion(3));
};

/// Meshes by tick.
using Meshes = std::map<std::uint64_t, const std::vector<float>*>;
Meshes meshes_of(const Peer& peer, std::size_t from) {
  Meshes meshes;
  for (std::size_t i = from; i < peer.frames.size(); ++i)
    meshes[peer.frames[i].message.tick] = &peer.frames[i].positions;
  return meshes;
}

/// Serves both until they have received `count` common ticks from here on, in which the tissue moved; all with the same
/// bits.
::testing::AssertionResult have_the_same_mesh(Peer& beside, Peer& behind, std::size_t count = 15) {
  const std::size_t from = beside.frames.size(), behind_from = behind.frames.size();
  const auto moved = [](const Peer::Frame& frame) { return frame.message.moved_vertices > 0; };
  std::size_t common = 0;
  std::string difference;
  const bool came = beside.until([&] {
    behind.poll();
    if (!beside.closed.empty() || !behind.closed.empty()) return true;
    const Meshes one = meshes_of(beside, from), other = meshes_of(behind, behind_from);
    common = 0;
    for (const auto& [tick, positions] : one) {
      const auto found = other.find(tick);
      if (found == other.end()) continue;
      ++common;
      const bool is_same = positions->size() == found->second->size() &&
                           std::memcmp(positions->data(), found->second->data(), 4 * positions->size()) == 0;
      if (!is_same) difference = "the meshes differ in tick " + std::to_string(tick);
    }
    if (!difference.empty()) return true;
    return common >= count &&
           std::any_of(beside.frames.begin() + static_cast<std::ptrdiff_t>(from), beside.frames.end(), moved);
  });
  if (!difference.empty()) return ::testing::AssertionFailure() << difference;
  for (const Peer* peer : {&beside, &behind})
    if (!peer->closed.empty()) return ::testing::AssertionFailure() << "closed: " << peer->closed[0];
  if (!came) return ::testing::AssertionFailure() << "only " << common << " ticks in common";
  return ::testing::AssertionSuccess();
}

TEST_F(RelayTest, AViewerBehindItHasWhatOneBesideTheDaemonHas) {
  RunningBrachyd brachyd(scene, needle());
  Relay relay(*broker);
  ASSERT_TRUE(relay.listens());
  constexpr auto kAll = net::kSubscribePoseHistory | net::kSubscribeScene;
  Peer beside(net::Role::kViewer, kAll, true), behind(net::Role::kViewer, kAll, true);
  ASSERT_TRUE(beside.join(brachyd.port) && behind.join(relay.port));
  EXPECT_TRUE(have_the_same_mesh(beside, behind));
  EXPECT_EQ(beside.topology.hash, behind.topology.hash);
  ASSERT_EQ(behind.scenes.size(), 1u);
  EXPECT_EQ(beside.scenes.at(0).structures.size(), behind.scenes[0].structures.size());
  std::size_t poses = 0;
  for (const auto& [tick, pose] : beside.poses)
    if (const auto found = behind.poses.find(tick); found != behind.poses.end()) {
      ++poses;
      EXPECT_TRUE(pose.R == found->second.R && pose.p == found->second.p) << tick;
    }
  EXPECT_GT(poses, 50u);
  ASSERT_TRUE(behind.until([&] {
    beside.poll();
    return behind.states.size() > 1 && !beside.states.empty();
  }));
  EXPECT_GT(behind.states.back().ticks, 0u);
  EXPECT_EQ(behind.states.back().viewers, 1u) << "of the relay";
  EXPECT_EQ(behind.states.back().device_holder, beside.states.back().device_holder);

  // A late viewer, and one of the surface alone, get it too.
  Peer late(net::Role::kViewer, 0, true), surface(net::Role::kViewer, net::kSubscribeSurface, true),
      beside_surface(net::Role::kViewer, net::kSubscribeSurface, true);
  ASSERT_TRUE(late.join(relay.port) && surface.join(relay.port) && beside_surface.join(brachyd.port));
  EXPECT_TRUE(have_the_same_mesh(beside, late));
  EXPECT_TRUE(have_the_same_mesh(beside_surface, surface));
  EXPECT_LT(surface.topology.rest_vertices.size(), beside.topology.rest_vertices.size());
  relay.process.send_signal(SIGTERM);
  const Ended ended = relay.process.wait();
  EXPECT_TRUE(exited(ended, 0)) << ended.err;
  EXPECT_GT(json_of(ended)["frames"], 20);
  brachyd.process.send_signal(SIGTERM);
  const Ended daemon = brachyd.process.wait();
  EXPECT_TRUE(exited(daemon, 0)) << daemon.err;
  EXPECT_GT(json_of(daemon)["broker"]["messages"], 20);
}

TEST_F(RelayTest, ABrowsersPageWatchesWithoutTheControls) {
  RunningBrachyd brachyd(scene, needle());
  Relay relay(*broker);
  ASSERT_TRUE(relay.listens());
  const auto line = relay.process.read_line();
  ASSERT_TRUE(line && line->starts_with("http on 127.0.0.1:")) << line.value_or("none");
  boost::asio::io_context io;
  net::test::WebSocketPeer page(io,
                                static_cast<std::uint16_t>(std::stoi(line->substr(line->rfind(':') + 1))));
  const auto until = [&](auto&& condition) {
    return wait_until([&] { return condition() || page.is_ended(); }, [&] { page.take_soon(); }) &&
           condition();
  };
  ASSERT_TRUE(until([&] { return page.is_open(); })) << page.answer();
  page.hello(net::Role::kOperator, net::kSubscribeSurface);
  const auto heard = [&](net::MessageType type) { return std::ranges::count(page.types, type) > 0; };
  EXPECT_TRUE(until([&] { return heard(net::MessageType::kFrame) && heard(net::MessageType::kError); }));
  EXPECT_EQ(page.fatal(), net::ErrorCode{}) << "an operator is let in, as a viewer";
}

TEST_F(RelayTest, TheBrokerIsKilledAndComesBack) {
  RunningBrachyd brachyd(scene, needle());
  Relay relay(*broker);
  ASSERT_TRUE(relay.listens());
  Peer beside(net::Role::kViewer, 0, true), behind(net::Role::kViewer, 0, true);
  ASSERT_TRUE(beside.join(brachyd.port) && behind.join(relay.port));
  EXPECT_TRUE(have_the_same_mesh(beside, behind, 5));
  broker->kill();
  ASSERT_TRUE(behind.until([&] {
    beside.poll();
    return !behind.events.empty() &&
           behind.events.back().text.find("no connection to the broker") != std::string::npos;
  }));
  const std::size_t frames = beside.frames.size();
  ASSERT_TRUE(beside.until([&] { return behind.poll(), beside.frames.size() > frames + 10; }))
      << "the daemon goes on";
  EXPECT_TRUE(behind.closed.empty());
  broker->start();
  EXPECT_TRUE(have_the_same_mesh(beside, behind));
  EXPECT_EQ(behind.topology.hash, beside.topology.hash);
}

TEST_F(RelayTest, TheRelayIsKilledAndStartedAgain) {
  RunningBrachyd brachyd(scene, needle());
  std::optional<Relay> relay(std::in_place, *broker);
  ASSERT_TRUE(relay->listens());
  const std::uint16_t port = relay->port;
  relay->process.send_signal(SIGKILL);
  relay->process.wait();
  relay.emplace(*broker, port);
  ASSERT_TRUE(relay->listens());
  EXPECT_EQ(relay->port, port);
  Peer beside(net::Role::kViewer, 0, true), behind(net::Role::kViewer, 0, true);
  ASSERT_TRUE(beside.join(brachyd.port) && behind.join(port));
  EXPECT_TRUE(have_the_same_mesh(beside, behind));
}

TEST_F(RelayTest, AnotherDaemonsViewersComeToTheSamePort) {
  std::optional<RunningBrachyd> brachyd(std::in_place, scene, needle());
  Relay relay(*broker);
  ASSERT_TRUE(relay.listens());
  Peer first(net::Role::kViewer, 0, true);
  ASSERT_TRUE(first.join(relay.port));
  ASSERT_TRUE(first.until([&] { return !first.frames.empty(); }));
  brachyd->process.send_signal(SIGKILL);
  brachyd->process.wait();
  const std::string other = folder.write("other.toml", read_file(scene) + "support_radius_mm = 10\n");
  brachyd.emplace(other, needle());
  ASSERT_TRUE(first.until([&] { return !first.closed.empty(); })) << "it is asked to reconnect";
  Peer beside(net::Role::kViewer, 0, true), behind(net::Role::kViewer, 0, true);
  ASSERT_TRUE(beside.join(brachyd->port) && behind.join(relay.port));
  EXPECT_TRUE(have_the_same_mesh(beside, behind));
}

/// The number that a page of the relay's shows behind `name`; NaN: none.
double metric(std::uint16_t http_port, const std::string& name) {
  try {
    const std::string page = http_get(http_port, "/metrics");
    const std::size_t at = page.find("\n" + name + " ");
    return at == page.npos ? NAN : std::stod(page.substr(at + 1 + name.size()));
  } catch (const boost::system::system_error&) {  // between two daemons nobody listens
    return NAN;
  }
}

/// The same once somebody listens.
double settled_metric(std::uint16_t http_port, const std::string& name) {
  double value = NAN;
  wait_until([&] { return !std::isnan(value = metric(http_port, name)); },
             [] { std::this_thread::sleep_for(kTurn); });
  return value;
}

std::uint16_t http_port_of(Relay& relay) {
  const auto line = relay.process.read_line();
  if (!line || !line->starts_with("http on 127.0.0.1:")) ADD_FAILURE() << line.value_or("none");
  return static_cast<std::uint16_t>(std::stoi(line->substr(line->rfind(':') + 1)));
}

TEST_F(RelayTest, ItTellsItsHealthAndWhatItCarries) {
  std::optional<RunningBrachyd> brachyd(std::in_place, scene, needle());
  Relay relay(*broker);
  ASSERT_TRUE(relay.listens());
  const std::uint16_t http = http_port_of(relay);
  EXPECT_TRUE(http_get(http, "/healthz").starts_with("HTTP/1.1 200"));
  Peer behind(net::Role::kViewer, 0, true);
  ASSERT_TRUE(behind.join(relay.port));
  ASSERT_TRUE(behind.until([&] { return behind.frames.size() > 5; }));
  EXPECT_EQ(metric(http, "brachy_relay_viewers"), 1);
  EXPECT_EQ(metric(http, "brachy_relay_simulations"), 1);
  EXPECT_GT(metric(http, "brachy_relay_frames_total"), 5);
  EXPECT_GT(metric(http, "process_resident_memory_bytes"), 1e6);
  broker->kill();
  EXPECT_TRUE(behind.until(
      [&] { return http_get(http, "/healthz").find("no connection to the broker") != std::string::npos; }));
  EXPECT_TRUE(http_get(http, "/healthz").starts_with("HTTP/1.1 503"));
}

TEST_F(RelayTest, APlanIsCarriedToWhoAsksForIt) {
  const std::string planned =
      folder.write("planned.toml", read_file(scene) + "[plan]\nfile = \"" BRACHY_CONFIG_DIR "/plan.toml\"\n");
  RunningBrachyd brachyd(planned);  // without a needle: no plan is changed while one is in the tissue
  Relay relay(*broker);
  ASSERT_TRUE(relay.listens());
  Peer desk(net::Role::kOperator, net::kSubscribePlan), behind(net::Role::kViewer, net::kSubscribePlan);
  ASSERT_TRUE(desk.join(brachyd.port) && behind.join(relay.port));
  ASSERT_TRUE(behind.until([&] { return desk.poll(), !behind.plans.empty() && !desk.plans.empty(); }));
  EXPECT_EQ(behind.plans.back().needles.size(), desk.plans.back().needles.size());
  net::PlanMessage edit;
  edit.kind = net::PlanKind::kEdited;
  edit.needles = {{0, false, 0, 90, "G7", "s-s-s"}};
  ASSERT_TRUE(desk.until([&] { return !desk.frames.empty(); }));
  desk.client.send(edit);
  ASSERT_TRUE(
      behind.until([&] { return desk.poll(), behind.plans.back().change == 1 || !desk.errors.empty(); }));
  ASSERT_TRUE(desk.errors.empty()) << desk.errors.back().text;
  Peer late(net::Role::kViewer, net::kSubscribePlan);
  ASSERT_TRUE(late.join(relay.port));
  ASSERT_TRUE(late.until([&] { return desk.poll(), !late.plans.empty(); }));
  EXPECT_EQ(late.plans.back().needles.at(0).hole, "G7");
}

// Publishers that change faster than once a second left a simulation each, until there was one in a second: 1.8 GB.
TEST_F(RelayTest, DaemonsThatChangeQuicklyLeaveNothingBehind) {
  RunningBrachyd brachyd(scene, needle());
  Relay relay(*broker);
  net::BrokerOptions options;
  options.url = broker->url();
  net::NatsLink link(options, options.stream_subject());
  ASSERT_TRUE(relay.listens());
  const std::uint16_t http = http_port_of(relay);
  // An epoch up to its first FRAME, which is said again by daemons that nobody has heard of.
  ASSERT_TRUE(link.publish(options.ask_subject(), {}));
  std::vector<net::Bytes> epoch;
  net::ChunkAssembler chunks(1u << 26);
  for (bool has_frame = false; !has_frame;) {
    const auto payload = link.next(kDeadline);
    ASSERT_TRUE(payload);
    const auto taken = chunks.take(*payload);
    if (taken == net::ChunkAssembler::Taken::kLeftOut || taken == net::ChunkAssembler::Taken::kLost) {
      epoch.clear();
      continue;
    }
    epoch.push_back(*payload);
    has_frame = taken == net::ChunkAssembler::Taken::kMessage &&
                chunks.message().header.type == net::MessageType::kFrame;
  }
  brachyd.process.send_signal(SIGTERM);
  brachyd.process.wait();
  double before = 0;
  for (int daemon = 1; daemon <= 400; ++daemon) {
    for (net::Bytes& payload : epoch) {
      std::memcpy(payload.data() + 8, &daemon, sizeof daemon);  // the publisher
      ASSERT_TRUE(link.publish(options.stream_subject(), payload));
    }
    if (daemon % 100 != 0) continue;
    ASSERT_TRUE(wait_until([&] { return metric(http, "brachy_relay_daemons_total") > daemon; },
                           [] { std::this_thread::sleep_for(kTurn); }));
    EXPECT_LE(settled_metric(http, "brachy_relay_simulations"), 3);
    const double bytes = settled_metric(http, "process_resident_memory_bytes");
    if (daemon == 100) before = bytes;
    EXPECT_LT(bytes - before, 20e6) << daemon;
    RecordProperty("relay_mb_" + std::to_string(daemon), std::to_string(1e-6 * bytes));
  }
}

TEST_F(RelayTest, WhatIsMissingOrMakesNoSenseIsAskedForAnew) {
  RunningBrachyd brachyd(scene, needle());
  Relay relay(*broker);
  ASSERT_TRUE(relay.listens());
  Peer beside(net::Role::kViewer, 0, true), behind(net::Role::kViewer, 0, true);
  ASSERT_TRUE(beside.join(brachyd.port) && behind.join(relay.port));
  EXPECT_TRUE(have_the_same_mesh(beside, behind, 3));

  // Another client of the broker, which listens first.
  net::BrokerOptions options;
  options.url = broker->url();
  net::NatsLink other(options, options.stream_subject());
  const auto say = [&](const net::Bytes& payload) {
    return other.publish(options.stream_subject(), payload);
  };
  const auto overheard = other.next(kDeadline);
  ASSERT_TRUE(overheard && overheard->size() > net::kChunkHeaderSize);
  EXPECT_TRUE(say({}));
  EXPECT_TRUE(say(net::Bytes(1000, std::byte{'x'})));
  EXPECT_TRUE(say(net::Bytes(overheard->begin(), overheard->begin() + net::kChunkHeaderSize)));
  EXPECT_TRUE(have_the_same_mesh(beside, behind, 3)) << "what is no chunk is left out";

  // Whatever is heard comes once more, far ahead, as after a gap. Once would not do: the relay may have asked for a new
  // epoch meanwhile, and leaves out what belongs to the one before.
  const auto is_told = [&] {
    beside.poll();
    if (auto ahead = other.next(std::chrono::milliseconds(0));
        ahead && ahead->size() > net::kChunkHeaderSize) {
      (*ahead)[24 + 5] = std::byte{1};  // of the sequence
      EXPECT_TRUE(say(*ahead));
    }
    return std::ranges::any_of(behind.events, [](const net::EventMessage& event) {
      return event.text.find("messages of the daemon are missing") != std::string::npos;
    });
  };
  ASSERT_TRUE(behind.until(is_told));
  EXPECT_TRUE(have_the_same_mesh(beside, behind));
}

TEST_F(RelayTest, WithoutABrokerTheDaemonWorksAndPublishesOnceThereIsOne) {
  broker->kill();
  RunningBrachyd brachyd(scene, needle());
  Peer beside(net::Role::kViewer, 0, true);
  ASSERT_TRUE(beside.join(brachyd.port));
  ASSERT_TRUE(beside.until([&] { return beside.frames.size() > 20; }));
  EXPECT_TRUE(brachyd.process.says("nothing is published until it is there"));
  Relay relay(*broker);
  broker->start();
  ASSERT_TRUE(relay.listens());
  Peer behind(net::Role::kViewer, 0, true);
  ASSERT_TRUE(behind.join(relay.port));
  EXPECT_TRUE(have_the_same_mesh(beside, behind, 3));
  brachyd.process.send_signal(SIGTERM);
  const Ended ended = brachyd.process.wait();
  EXPECT_TRUE(exited(ended, 0)) << ended.err;
  EXPECT_EQ(ended.err.find("nothing is published"), ended.err.rfind("nothing is published"))
      << "it says so once";
}

TEST_F(RelayTest, ABrokerThatStandsStillHoldsNobodyUp) {
  RunningBrachyd brachyd(scene, needle());
  Peer beside(net::Role::kViewer, 0, true);
  ASSERT_TRUE(beside.join(brachyd.port));
  ASSERT_TRUE(brachyd.process.says(": connected"));
  broker->send_signal(SIGSTOP);
  const std::size_t frames = beside.frames.size();
  ASSERT_TRUE(beside.until([&] { return beside.frames.size() > frames + 60; }));
  brachyd.process.send_signal(SIGTERM);
  EXPECT_TRUE(exited(brachyd.process.wait(), 0));
  broker->send_signal(SIGCONT);
}

TEST(Relay, IsToldWhatItsUrlLacks) {
  EXPECT_TRUE(
      refused_in_one_line(run_brachyd({"--port", "0", "--nats", "localhost"}), {"--nats", "nats://HOST"}));
  const Ended ended = run_brachy({"relay", "--nats", "localhost"});
  EXPECT_TRUE(refused_in_one_line(ended, {"--nats", "nats://HOST"}));
}

}  // namespace
}  // namespace brachy
