#pragma once

#include <algorithm>
#include <string>

#include "net/igtl/igtl_server.h"
#include "tests/net/igtl/igtl_peer.h"
#include "tests/net/net_testing.h"

namespace brachy::net::igtl::test {

/// An OpenIGTLink listener beside a native server, with a fake simulation behind both, all on one io_context.
struct IgtlFixture : net::test::ServerFixture {
  /// `wait`: silent clients receive the stream after this time.
  void start_igtl(std::chrono::milliseconds wait = std::chrono::milliseconds(0), ServerOptions options = {}) {
    options.topology_name = "gland";
    start(options);
    IgtlOptions own;
    own.first_message_wait = wait;
    start_both(options, own);
  }
  void start_both(ServerOptions options, const IgtlOptions& own) {
    options.topology_name = "gland";
    start(options);
    igtl.emplace(io, own, *server, tissue, [this](const std::string& line) { log.push_back(line); });
  }
  bool has_logged(const std::string& part) const {
    return std::ranges::any_of(log,
                               [&](const std::string& line) { return line.find(part) != std::string::npos; });
  }
  /// One tick of 5 ms for both, and of the clock.
  void publish_both() {
    clock.advance(std::chrono::milliseconds(5));
    simulation.step();
    server->publish(simulation.snapshot());
    igtl->publish(simulation.snapshot());
  }
  /// Serves all clients until `condition()`; the peer reads everything.
  template <class Condition>
  bool until_read(IgtlPeer& peer, Condition&& condition) {
    return until([&] {
      peer.take();
      return condition();
    });
  }
  /// Likewise, with a tick in each turn; false if the condition does not hold within two minutes of them.
  template <class Condition>
  bool until_ticked(IgtlPeer& peer, Condition&& condition) {
    for (int tick = 0; tick < 24'000; ++tick) {
      publish_both();
      do {  // all of it arrives before the next tick
        io.restart();
        peer.take();
      } while (io.run_one_for(std::chrono::milliseconds(1)) > 0);
      if (condition()) return true;
    }
    return false;
  }
  static RigidTransform at(double x, double y, double z) { return {Mat3::Identity(), Vec3(x, y, z)}; }

  std::optional<IgtlServer> igtl;
};

}  // namespace brachy::net::igtl::test
