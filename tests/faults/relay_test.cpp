// Viewers behind `brachy relay`: brachyd, a real nats-server, relays and viewers, any of which is killed.
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <csignal>
#include <cstring>
#include <map>
#include <optional>

#include "net/broker/chunks.h"
#include "net/broker/nats_link.h"
#include "test_paths.h"
#include "tests/apps/apps_testing.h"
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
