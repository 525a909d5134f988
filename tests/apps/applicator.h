#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "tests/apps/peer.h"

namespace brachy::test {

/// A device that sends poses and presses its button.
class Applicator {
 public:
  explicit Applicator(const std::string& name = "applicator")
      : peer(net::Role::kDevice, net::kSubscribePoseHistory, false, name) {}

  bool join(std::uint16_t port) { return peer.join(port); }
  bool go(const std::vector<RigidTransform>& way) {
    return std::all_of(way.begin(), way.end(), [&](const RigidTransform& to) { return peer.show(to); });
  }
  const std::vector<Seed>& seeds() const { return peer.client.mesh().seeds(); }
  /// Presses and releases the button until one more seed is seen.
  bool drop() {
    const std::size_t before = seeds().size();
    peer.client.press(true);
    peer.client.press(false);
    return peer.until([&] { return seeds().size() > before; });
  }
  bool has_event(const std::string& part) const {
    return std::ranges::any_of(peer.events, [&](const net::EventMessage& e) {
      return e.kind == net::EventKind::kSeed && e.text.find(part) != std::string::npos;
    });
  }
  Peer peer;
};

}  // namespace brachy::test
