// Devices that die, stall, send invalid data and reconnect, over real sockets: the forces that they receive.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptics/force/force_gate.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_daemon.h"

namespace brachy {
namespace {

using namespace test;

/// A device that keeps sending its present pose, so that a hand at rest is not taken for a stalled device.
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

  /// Follows `way`, sending each pose until a frame shows that the simulation used it.
  bool go(const std::vector<RigidTransform>& way) {
    return std::all_of(way.begin(), way.end(), [&](const RigidTransform& to) {
      X_WN = to;
      return until([&] { return !peer.frames.empty() && needle().X_WN == to; });
    });
  }
  const NeedleState& needle() const { return peer.last().message.needles.at(peer.client.needle()).state; }

  std::uint16_t flags() const { return peer.forces.empty() ? 0 : peer.forces.back().flags; }
  bool is_latched() const { return (flags() & net::kForceLatched) != 0; }
  /// Arms, again if the poses stalled on a busy machine, until the full force is received: that of the newest frame or
  /// of a later tick.
  bool arm_fully() {
    return until([&] {
      if (is_latched()) peer.client.arm();
      if (peer.forces.empty() || peer.frames.empty()) return false;
      if (peer.forces.back().tick < peer.last().message.tick) return false;
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
  double force_n() const { return peer.forces.empty() ? 0 : peer.forces.back().forces.force_n.norm(); }
  /// From one FORCE to the next.
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
    if (!evaluates_local_model) o.limits.damping_n_s_per_mm = 0.05;  // no round trip makes the tissue softer
    o.name = name;
    return o;
  }
};

bool has_told(const Peer& peer, const std::string& what) {
  return std::any_of(peer.events.begin(), peer.events.end(), [&](const net::EventMessage& event) {
    return event.kind == net::EventKind::kSafety && event.text.find(what) != std::string::npos;
  });
}

/// The tip comes to the capsule at z = -19.5 mm and ends 4 mm beyond: not enough to puncture it.
std::vector<RigidTransform> way_onto_capsule() {
  std::vector<RigidTransform> way;
  for (double z = -33.5; z <= -15.5; z += 3) way.push_back(tip_at(8, -4, z));
  return way;
}

/// One FORCE differs by at most 0.5 N from the one before it, also from one that was replaced before it was sent.
double largest_allowed_step(const DaemonSummary& summary) {
  return 0.5 * (1 + static_cast<double>(summary.forces_replaced)) + 1e-9;
}

/// Since the last latch the force only decreases, by allowed steps, to 0. Where the ticks stalled as well, as on a busy
/// machine, the force was gone before the latch, and its flags say so; ForceLinkTest asserts the fall in virtual time.
void expect_fell_to_zero(const Hand& hand, const DaemonSummary& summary) {
  const auto& forces = hand.peer.forces;
  const auto armed = std::find_if(forces.rbegin(), forces.rend(), [](const net::ForceMessage& force) {
    return (force.flags & net::kForceLatched) == 0;
  });
  ASSERT_NE(armed, forces.rend());
  double last_n = armed->forces.force_n.norm();
  if (!(armed->flags & (net::kForceExpired | net::kForceRamping))) {
    EXPECT_GT(last_n, 1);
  }
  for (auto force = armed.base(); force != forces.end(); ++force) {
    const double now_n = force->forces.force_n.norm();
    ASSERT_FALSE(force->flags & net::kForceArmed);
    ASSERT_LE(now_n, last_n);
    ASSERT_GE(now_n, last_n - largest_allowed_step(summary));
    ASSERT_EQ((force->flags & net::kForceRamping) != 0, now_n > 0);
    last_n = now_n;
  }
  EXPECT_EQ(last_n, 0);
}

TEST(DaemonForce, ANeedlePushedIntoTheCapsuleIsPushedBackAsTheTissueDoes) {
  RunningDaemon daemon(small());
  Hand hand;
  ASSERT_TRUE(hand.join(daemon.port()));
  ASSERT_TRUE(hand.go({way_onto_capsule().front()}));
  ASSERT_TRUE(hand.arm_fully());
  EXPECT_EQ(hand.force_n(), 0);  // nothing is touched yet
  ASSERT_TRUE(hand.go(way_onto_capsule()));
  ASSERT_TRUE(hand.arm_fully());
  ASSERT_EQ(hand.needle().contact, ContactState::kTouching);
  const double pressed_n = hand.force_n();
  EXPECT_GT(pressed_n, 1.5);
  EXPECT_LT(pressed_n, 3);
  EXPECT_NEAR(pressed_n, hand.needle().forces.axial_n, 1e-6);
  EXPECT_NEAR(hand.peer.forces.back().forces.force_n.z(), -pressed_n, 1e-6);  // out
  ASSERT_TRUE(hand.go(way_in()));
  ASSERT_TRUE(hand.arm_fully());
  ASSERT_EQ(hand.needle().contact, ContactState::kInserted);
  EXPECT_GT(hand.needle().forces.force_n.norm(), 3.5);  // more than the device's limit
  ASSERT_TRUE(hand.until([&] { return std::abs(hand.force_n() - 3.3) < 1e-9; }));
  EXPECT_TRUE(hand.flags() & net::kForceLimited);
  ASSERT_TRUE(hand.go(way_out()));
  ASSERT_TRUE(hand.arm_fully());
  ASSERT_EQ(hand.needle().contact, ContactState::kWithdrawn);
  EXPECT_EQ(hand.force_n(), 0);
  for (const net::ForceMessage& force : hand.peer.forces) ASSERT_LE(force.forces.force_n.norm(), 3.3 + 1e-9);
  const DaemonSummary& summary = daemon.stop();
  EXPECT_GE(summary.interventions[static_cast<std::size_t>(Intervention::kForceLimited)], 1u);
  EXPECT_LE(hand.largest_step(), largest_allowed_step(summary));
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
    // On a busy machine the limit on changes of force may still hold it back.
    ASSERT_TRUE(first.until([&] { return std::abs(first.force_n() - 3.3) < 1e-9; }));
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
  EXPECT_LT(second.force_n(), 0.5);
  ASSERT_TRUE(second.go({tip_at(9.5, -4.2, 14)}));
  ASSERT_TRUE(second.arm_fully());
  EXPECT_GT(second.force_n(), 2);
  EXPECT_TRUE(has_told(second.peer, "armed by hand (127.0.0.1:"));
  const DaemonSummary& summary = daemon.stop();
  EXPECT_LE(second.largest_step(), largest_allowed_step(summary));
  EXPECT_EQ(summary.interventions[static_cast<std::size_t>(Intervention::kDisconnected)], 1u);
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
  second.X_WN = tip_at(8, -4, 5);  // the tissue is there where it begins
  ASSERT_TRUE(second.join(daemon.port()));
  ASSERT_TRUE(second.go({second.X_WN}));
  for (const net::ForceMessage& force : second.peer.forces) ASSERT_EQ(force.forces.force_n.norm(), 0);
  EXPECT_EQ(second.needle().contact, ContactState::kInserted);
  EXPECT_EQ(second.count(Intervention::kDisconnected), 0u);
  ASSERT_TRUE(second.go({tip_at(8, -4, 8)}));
  ASSERT_TRUE(second.until([&] {
    if (second.is_latched()) second.peer.client.arm();  // the machine was busy
    return second.force_n() > 1.65;
  }));
  ASSERT_TRUE(second.arm_fully());
  EXPECT_GT(second.force_n(), 2.5);
  EXPECT_LE(second.largest_step(), largest_allowed_step(daemon.stop()));
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
  const std::size_t fell = hand.peer.forces.size();
  hand.is_sending = true;  // new poses alone are not enough
  ASSERT_TRUE(hand.until([&] { return hand.peer.forces.size() >= fell + 200; }));
  EXPECT_EQ(hand.count(Intervention::kStale), before + 1);
  const std::vector<net::ForceMessage> until_then = hand.peer.forces;
  ASSERT_TRUE(hand.arm_fully());
  ASSERT_TRUE(hand.until([&] { return std::abs(hand.force_n() - 3.3) < 1e-9; }));
  const DaemonSummary& summary = daemon.stop();
  EXPECT_LE(hand.largest_step(), largest_allowed_step(summary));
  hand.peer.forces = until_then;
  expect_fell_to_zero(hand, summary);
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
  EXPECT_EQ(hand.count(Intervention::kNotFinite), 1u);
  EXPECT_EQ(hand.needle().X_WN, way_in().back());
  const std::vector<net::ForceMessage> until_then = hand.peer.forces;
  ASSERT_TRUE(hand.arm_fully());
  ASSERT_TRUE(hand.until([&] { return std::abs(hand.force_n() - 3.3) < 1e-9; }));
  const DaemonSummary& summary = daemon.stop();
  EXPECT_LE(hand.largest_step(), largest_allowed_step(summary));
  hand.peer.forces = until_then;
  expect_fell_to_zero(hand, summary);
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
  // 200 per second as in the simulation, not 30: missing ones were replaced by newer ones.
  EXPECT_LT(models.back().model.tick - models.front().model.tick, 2 * models.size());
  for (std::size_t i = 1; i < models.size(); ++i) ASSERT_GT(models[i].model.tick, models[i - 1].model.tick);
  EXPECT_EQ(models.back().max_force_n, 3.3);
  EXPECT_EQ(models.back().max_stiffness_n_per_mm, 1);  // 2b/T of the default damping at 1 kHz
}

TEST(DaemonForce, TwoDevicesMoveTwoNeedlesAndAFaultIsOneOnes) {
  Scene scene = small();
  scene.needle.count = 2;
  RunningDaemon daemon(scene);
  Hand left(1, false, "left"), right(0, false, "right");
  ASSERT_TRUE(left.join(daemon.port()));
  ASSERT_TRUE(right.join(daemon.port()));
  left.X_WN = tip_at(-8, -4, -40);
  right.X_WN = way_onto_capsule().front();
  ASSERT_TRUE(left.until([&] {
    right.poll();
    return !left.peer.frames.empty() && left.needle().present && left.needle().X_WN == left.X_WN &&
           left.peer.last().message.needles.at(0).state.X_WN == right.X_WN;
  }));
  for (const RigidTransform& to : way_onto_capsule()) {
    right.X_WN = to;
    ASSERT_TRUE(left.until([&] {
      right.poll();
      return !right.peer.frames.empty() && right.needle().X_WN == to;
    }));
  }
  const auto right_is_pushed_back = [&] {
    right.poll();
    if (right.is_latched()) right.peer.client.arm();  // the machine was busy
    return right.force_n() > 1.5;
  };
  ASSERT_TRUE(left.until(right_is_pushed_back));
  // Its force had perhaps gone before, of poses that a busy machine kept back: then nobody is told of this one.
  std::uint64_t sent = 0;
  while (!has_told(left.peer, "needle 1: pose has NaN")) {
    ASSERT_TRUE(left.until([&] {
      right.poll();
      if (left.is_latched()) left.peer.client.arm();
      return left.flags() == net::kForceArmed;
    }));
    left.peer.client.send_pose(tip_at(std::numeric_limits<double>::quiet_NaN(), 0, 0), monotonic_ns());
    ++sent;
    ASSERT_TRUE(left.until([&] {
      right.poll();
      return left.is_latched();
    }));
  }
  ASSERT_TRUE(left.until(right_is_pushed_back));
  EXPECT_EQ(left.force_n(), 0);
  EXPECT_EQ(right.count(Intervention::kNotFinite), 0u);
  EXPECT_EQ(left.count(Intervention::kNotFinite), sent);
  for (const net::ForceMessage& force : right.peer.forces) ASSERT_EQ(force.needle, 0);
}

}  // namespace
}  // namespace brachy
