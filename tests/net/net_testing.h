#pragma once

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "net/client/client.h"
#include "net/server/server.h"
#include "tests/net/fake_simulation.h"
#include "tests/net/manual_clock.h"
#include "tests/wait.h"

namespace brachy::net::test {

/// Runs `io` until `condition()` holds; `on_idle()` is called whenever there is nothing to do, which the system has had
/// a moment to change. False if the condition does not hold after 12,000 idle turns, or far more busy ones.
template <class Condition, class OnIdle>
bool pump_turns(boost::asio::io_context& io, Condition&& condition, OnIdle&& on_idle) {
  int idle = 0;
  for (int turns = 0; !condition(); ++turns) {
    if (idle >= 12'000 || turns >= 1'000'000) return false;
    if (io.stopped()) io.restart();
    if (io.run_one_for(brachy::test::kTurn) > 0) continue;
    ++idle;
    on_idle();
  }
  return true;
}

/// A Client that records what it receives.
struct Recorder {
  explicit Recorder(boost::asio::io_context& io, ClientOptions options = {})
      : client(io, std::move(options), handlers()) {}
  ClientHandlers handlers();

  int welcomes = 0, topologies = 0;
  WelcomeMessage welcome;
  TopologyMessage topology;
  std::vector<FrameMessage> frames;
  std::vector<StateMessage> states;
  std::vector<EventMessage> events;
  std::vector<DoseMessage> doses;
  std::vector<SceneMessage> scenes;
  std::vector<ImageMessage> images;
  std::vector<ScannerMessage> scanners;
  std::vector<ErrorMessage> errors;
  std::vector<ForceMessage> forces;
  std::vector<LocalModelMessage> models;
  std::vector<std::string> closed;
  Client client;
};

/// A server on a free port of the loopback with a fake simulation behind it, all on one io_context.
struct ServerFixture : ::testing::Test {
  void start(ServerOptions options = {});
  void publish() {
    simulation.step();
    server->publish(simulation.snapshot());
  }
  ClientOptions on_clock(ClientOptions options = {});
  std::unique_ptr<Recorder> join(ClientOptions options = {});  ///< connected, not yet welcomed
  std::unique_ptr<Recorder> join_as(Role role, const std::string& name);
  /// Serves everybody until the condition holds. Each time there is nothing to do, 5 ms pass: so the machine's other
  /// work takes no time. False if it does not hold within a minute.
  template <class Condition>
  bool until(Condition&& condition) {
    return pump_turns(io, condition, [this] { clock.advance(std::chrono::milliseconds(5)); });
  }
  /// Likewise, and no time passes but what `condition` lets pass.
  template <class Condition>
  bool until_at_once(Condition&& condition) {
    return pump_turns(io, condition, [] {});
  }
  /// Lets this much time pass, and serves everybody meanwhile.
  void pass(std::chrono::milliseconds time) {
    const std::int64_t end = clock.now_ns() + in_ns(time);
    until([&] { return clock.now_ns() >= end; });
  }

  ManualClock clock;  ///< the server's and its clients'
  boost::asio::io_context io;
  Tissue tissue = line_tissue(40);
  FakeSimulation simulation{tissue};
  std::vector<NeedlePose> poses;
  std::vector<std::uint16_t> pose_needles;  ///< of each of `poses`
  std::vector<std::pair<bool, std::string>> devices;
  DeviceInfo last_device;
  std::vector<std::pair<std::uint16_t, std::string>> arms;
  std::vector<std::pair<std::uint16_t, bool>> drops;
  std::vector<std::pair<ControlMessage, std::string>> controls;
  std::vector<ScannerMessage> scanner_requests;
  std::string control_refusal;  ///< the handlers' answer
  std::vector<std::string> log;
  PoseVerdict verdict;
  std::unique_ptr<Server> server;
};

}  // namespace brachy::net::test
