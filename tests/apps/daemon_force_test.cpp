// Devices that die, stall, send nonsense and come back, over real sockets: what their hands get.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptics/force_gate.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_daemon.h"

namespace brachy {
namespace {

using namespace test;

/// A device that keeps sending the pose it is at: the machine may be busy, a hand that is still is no stalled one.
class Hand {
 public:
  explicit Hand(std::uint16_t needle = net::kAnyNeedle, bool evaluates_local_model = false,
                const std::string& name = "hand")
      : peer(options(needle, evaluates_local_model, name)) {}

  bool join(std::uint16_t port) { return peer.join(port); }

  void poll() {
    send();
    peer.poll();
  }
  template <class Condition>
  bool until(Condition&& condition) {
    return peer.until([&] {
      send();
      return condition();
    });
  }

  /// Goes along `way`, each pose until a frame shows that the simulation used it.
  bool go(const std::vector<RigidTransform>& way) {
    return std::all_of(way.begin(), way.end(), [&](const RigidTransform& to) {
      X_WN = to;
      return until([&] { return !peer.frames.empty() && needle().X_WN == to; });
    });
  }
  const NeedleState& needle() const { return peer.last().message.needles.at(peer.client.needle()).state; }

  std::uint16_t flags() const { return peer.forces.empty() ? 0 : peer.forces.back().flags; }
  bool is_latched() const { return (flags() & net::kForceLatched) != 0; }
  /// Arms, and again where the machine was so busy that the poses stalled, until the force is all there.
  bool arm_fully() {
    return until([&] {
      if (is_latched()) peer.client.arm();
      return flags() == net::kForceArmed || flags() == (net::kForceArmed | net::kForceLimited);
    });
  }
  /// How often since the daemon's start.
  std::uint64_t count(Intervention intervention) {
    std::uint64_t count = 0;
    EXPECT_TRUE(peer.refresh_state());
    for (const net::SafetyCount& c : peer.states.back().safety)
      if (c.needle == peer.client.needle() && c.code == static_cast<std::uint16_t>(intervention))
        count = c.count;
    return count;
  }
  double largest_step() const {
    double largest = 0;
    for (std::size_t i = 1; i < peer.forces.size(); ++i)
      largest = std::max(largest, (peer.forces[i].forces.force_n - peer.forces[i - 1].forces.force_n).norm());
    return largest;
  }

  Peer peer;
  RigidTransform X_WN = tip_at(8, -4, -40);
  bool is_sending = true;

 private:
  /// 500 a second at most: the server takes 2000.
  void send() {
    const std::int64_t now_ns = monotonic_ns();
    if (!is_sending || now_ns - sent_ns_ < 2'000'000) return;
    sent_ns_ = now_ns;
    peer.client.send_pose(X_WN, now_ns);
  }
  std::int64_t sent_ns_ = 0;

  static net::ClientOptions options(std::uint16_t needle, bool evaluates_local_model,
                                    const std::string& name) {
    net::ClientOptions o;
    o.role = net::Role::kDevice;
    o.needle = needle;
    o.evaluates_local_model = evaluates_local_model;
    o.name = name;
    return o;
  }
};

bool has_told(const Peer& peer, const std::string& what) {
  return std::any_of(peer.events.begin(), peer.events.end(), [&](const net::EventMessage& event) {
    return event.kind == net::EventKind::kSafety && event.text.find(what) != std::string::npos;
  });
}

TEST(DaemonForce, ADeviceKilledMidInsertionLatchesItsNeedleForTheNextUntilItArms) {
  RunningDaemon daemon(small());
  Peer viewer;
  ASSERT_TRUE(viewer.join(daemon.port()));
  {
    Hand first;
    ASSERT_TRUE(first.join(daemon.port()));
    ASSERT_TRUE(first.go(way_in()));
    ASSERT_EQ(first.needle().contact, ContactState::kInserted);
    ASSERT_TRUE(first.arm_fully());
    EXPECT_LE(first.largest_step(), 0.5 + 1e-9);
  }  // its socket closes
  ASSERT_TRUE(viewer.until([&] { return has_told(viewer, "device lost in contact"); }));
  Hand second;
  second.X_WN = way_in().back();  // inside
  ASSERT_TRUE(second.join(daemon.port()));
  ASSERT_TRUE(second.until([&] { return second.peer.forces.size() >= 200; }));
  for (const net::ForceMessage& force : second.peer.forces) {
    ASSERT_TRUE(force.flags & net::kForceLatched);
    ASSERT_EQ(force.forces.force_n.norm(), 0);
  }
  EXPECT_EQ(second.count(Intervention::kDisconnected), 1u);
  second.peer.forces.clear();
  second.peer.client.arm();
  ASSERT_TRUE(second.until([&] { return (second.flags() & net::kForceArmed) != 0; }));
  EXPECT_TRUE(second.flags() & net::kForceRamping);
  ASSERT_TRUE(second.arm_fully());
  EXPECT_LE(second.largest_step(), 0.5 + 1e-9);
  EXPECT_TRUE(has_told(second.peer, "armed by hand (127.0.0.1:"));
  EXPECT_EQ(daemon.stop().interventions[static_cast<std::size_t>(Intervention::kDisconnected)], 1u);
}

TEST(DaemonForce, WhoReconnectsInsideWithoutAFaultGetsARampFromZero) {
  RunningDaemon daemon(small());
  {
    Hand first;
    ASSERT_TRUE(first.join(daemon.port()));
    ASSERT_TRUE(first.go({tip_at(8, -4, -40)}));
    ASSERT_TRUE(first.arm_fully());
  }  // out of contact: no fault
  Hand second;
  second.X_WN = way_in().back();  // the tissue is there where it begins
  ASSERT_TRUE(second.join(daemon.port()));
  ASSERT_TRUE(second.until([&] { return second.peer.forces.size() >= 2; }));
  EXPECT_LT(second.peer.forces[0].forces.force_n.norm(), 0.05);
  EXPECT_EQ(second.count(Intervention::kDisconnected), 0u);
  ASSERT_TRUE(second.arm_fully());
  EXPECT_LE(second.largest_step(), 0.5 + 1e-9);
}

TEST(DaemonForce, AStalledDeviceLosesItsForceAndIsToldSo) {
  RunningDaemon daemon(small());
  Hand hand;
  ASSERT_TRUE(hand.join(daemon.port()));
  ASSERT_TRUE(hand.go(way_in()));
  ASSERT_TRUE(hand.arm_fully());
  const std::uint64_t before = hand.count(Intervention::kStale);
  hand.peer.events.clear();
  hand.is_sending = false;
  ASSERT_TRUE(hand.until([&] { return hand.is_latched() && has_told(hand.peer, "no pose for 50 ms"); }));
  ASSERT_TRUE(hand.until([&] { return !(hand.flags() & net::kForceRamping); }));
  EXPECT_EQ(hand.peer.forces.back().forces.force_n.norm(), 0);
  EXPECT_LE(hand.largest_step(), 0.5 + 1e-9);
  hand.is_sending = true;  // that poses come again is not enough
  hand.peer.forces.clear();
  ASSERT_TRUE(hand.until([&] { return hand.peer.forces.size() >= 200; }));
  EXPECT_TRUE(std::all_of(hand.peer.forces.begin(), hand.peer.forces.end(),
                          [](const net::ForceMessage& force) { return force.flags == net::kForceLatched; }));
  EXPECT_EQ(hand.count(Intervention::kStale), before + 1);
  ASSERT_TRUE(hand.arm_fully());
}

TEST(DaemonForce, APoseWithNaNTakesTheForceAway) {
  RunningDaemon daemon(small());
  Hand hand;
  ASSERT_TRUE(hand.join(daemon.port()));
  ASSERT_TRUE(hand.go(way_in()));
  ASSERT_TRUE(hand.arm_fully());
  hand.peer.client.send_pose(tip_at(std::numeric_limits<double>::quiet_NaN(), 0, 0), monotonic_ns());
  ASSERT_TRUE(hand.until([&] { return hand.is_latched(); }));
  ASSERT_TRUE(hand.until([&] { return !(hand.flags() & net::kForceRamping); }));
  EXPECT_EQ(hand.peer.forces.back().forces.force_n.norm(), 0);
  EXPECT_EQ(hand.count(Intervention::kNotFinite), 1u);
  EXPECT_EQ(hand.needle().X_WN, way_in().back());
  EXPECT_LE(hand.largest_step(), 0.5 + 1e-9);
  ASSERT_TRUE(hand.arm_fully());
}

TEST(DaemonForce, AnOperatorMayArmAndAViewerMayNot) {
  RunningDaemon daemon(small());
  Peer viewer, chief(net::Role::kOperator, 0, false, "chief");
  ASSERT_TRUE(viewer.join(daemon.port()));
  ASSERT_TRUE(chief.join(daemon.port()));
  Hand hand;
  ASSERT_TRUE(hand.join(daemon.port()));
  hand.peer.client.send_pose(tip_at(std::numeric_limits<double>::quiet_NaN(), 0, 0), monotonic_ns());
  ASSERT_TRUE(hand.until([&] { return hand.is_latched(); }));
  viewer.client.arm(0);
  ASSERT_TRUE(viewer.until([&] { return !viewer.errors.empty(); }));
  EXPECT_EQ(viewer.errors[0].code, net::ErrorCode::kNotDevice);
  EXPECT_FALSE(has_told(viewer, "armed by"));
  chief.client.arm(0);
  ASSERT_TRUE(chief.until([&] {
    hand.poll();
    return has_told(chief, "armed by chief");
  }));
}

TEST(DaemonForce, ADeviceWithTheLocalModelGetsOneEachTick) {
  RunningDaemon daemon(small());
  Hand hand(0, true);
  ASSERT_TRUE(hand.join(daemon.port()));
  ASSERT_TRUE(hand.until([&] { return hand.peer.models.size() >= 100; }));
  ASSERT_TRUE(hand.until([&] { return hand.peer.models.back().input_sequence > 0; }));
  const auto& models = hand.peer.models;
  // 200 a second of the simulation, not 30: what is missing was replaced by a newer one.
  EXPECT_LT(models.back().model.tick - models.front().model.tick, 2 * models.size());
  for (std::size_t i = 1; i < models.size(); ++i) ASSERT_GT(models[i].model.tick, models[i - 1].model.tick);
  EXPECT_EQ(models.back().max_force_n, 3.3);
  EXPECT_EQ(models.back().max_stiffness_n_per_mm, 1);  // 2b/T of the default damping at 1 kHz
}

}  // namespace
}  // namespace brachy
