// The forces sent to devices, with simulated time.
#include "apps/daemon/forces/force_link.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "haptics/force/negotiation.h"
#include "tests/haptics/milliseconds.h"

namespace brachy {
namespace {

constexpr double kStiffness = 0.1;  // N/mm, which a device on a near network renders

/// A tissue that holds each needle like a spring; a device that moves it, or not, a millisecond at a time.
struct ForceLinkTest : ::testing::Test {
  explicit ForceLinkTest(std::size_t needles = 1) : tick(needles), link(needles, outputs()) {
    for (NeedleTick& needle : tick.needles) {
      needle.is_in_contact = true;
      needle.model.in_contact = true;
      needle.model.axial_stiffness_n_per_mm = kStiffness;
      needle.model.axial_min_n = -50;
      needle.model.axial_max_n = 50;
      needle.forces.force_n = Vec3(0, 0, -2);
      needle.forces.axial_n = 2;
    }
  }

  ForceLinkOutputs outputs() {
    ForceLinkOutputs o;
    o.send_force = [this](const net::ForceMessage& message) {
      forces.push_back(message);
      sent_ns.push_back(now_ns);
    };
    o.send_model = [this](const net::LocalModelMessage& message) { models.push_back(message); };
    o.round_trip_s = [this](std::uint16_t) { return round_trip_s; };
    o.announce = [this](const net::EventMessage& event) { events.push_back(event); };
    return o;
  }

  void attach(const net::DeviceInfo& device = {}) { link.attach(device); }

  NeedlePose pose() {
    NeedlePose pose;
    pose.X_WN.p = Vec3(0, 0, depth_mm);
    pose.sequence = ++sequence;
    pose.stamp_ns = now_ns - 7 * kMs;  // another clock
    pose.received_ns = now_ns;
    pose.present = true;
    return pose;
  }

  /// As in the daemon: poses when they arrive, a tick each 5 ms, the cycle each 1 ms.
  void run(int milliseconds, std::uint16_t needle = 0) {
    for (int i = 0; i < milliseconds; ++i) {
      now_ns += kMs;
      if (is_sending) {
        last_pose = pose();
        link.pose_accepted(needle, last_pose);
      }
      if (is_ticking && now_ns % (5 * kMs) == 0) {
        ++tick.tick;
        tick.needles[needle].input_sequence = last_pose.sequence;
        tick.needles[needle].input_stamp_ns = last_pose.stamp_ns;
        tick.needles[needle].input_received_ns = last_pose.received_ns;
        tick.needles[needle].model.tick = tick.tick;
        tick.needles[needle].model.reference_tip = last_pose.X_WN.p;
        link.on_tick(tick, now_ns);
      }
      link.cycle(now_ns);
    }
  }

  Vec3 hand() const { return forces.empty() ? Vec3(Vec3::Zero()) : forces.back().forces.force_n; }
  std::uint16_t flags() const { return forces.empty() ? 0 : forces.back().flags; }
  double largest_step() const {
    double largest = 0;
    for (std::size_t i = 1; i < forces.size(); ++i)
      largest = std::max(largest, (forces[i].forces.force_n - forces[i - 1].forces.force_n).norm());
    return largest;
  }
  std::uint64_t count(Intervention i, std::uint16_t needle = 0) const { return link.gate(needle).count(i); }
  std::size_t told(Intervention i) const {
    return static_cast<std::size_t>(std::count_if(events.begin(), events.end(), [&](const auto& event) {
      return event.kind == net::EventKind::kSafety && event.text.find(to_string(i)) != std::string::npos;
    }));
  }

  std::int64_t now_ns = 1'000 * kMs;
  TickForces tick;
  ForceLink link;
  std::optional<double> round_trip_s = 0.0002;
  double depth_mm = 20;
  bool is_sending = true, is_ticking = true;
  std::uint64_t sequence = 0;
  NeedlePose last_pose;
  std::vector<net::ForceMessage> forces;
  std::vector<std::int64_t> sent_ns;
  std::vector<net::LocalModelMessage> models;
  std::vector<net::EventMessage> events;
};

TEST_F(ForceLinkTest, WhoConnectsInsideFeelsNothingAtFirstAndAllOfItHalfASecondLater) {
  EXPECT_FALSE(link.is_active());
  attach();
  EXPECT_TRUE(link.is_active());
  run(6);
  EXPECT_LT(hand().norm(), 0.05);
  EXPECT_EQ(flags(), net::kForceArmed | net::kForceRamping);
  run(250);
  EXPECT_NEAR(hand().z(), -1, 0.1);
  run(300);
  EXPECT_NEAR(hand().z(), -2, 1e-9);
  EXPECT_EQ(flags(), net::kForceArmed);
  EXPECT_LE(largest_step(), 0.5 + 1e-9);
  EXPECT_TRUE(events.empty());
}

TEST_F(ForceLinkTest, AForceIsToldWithItsPartsAndThePoseItAnswers) {
  attach();
  run(600);
  const net::ForceMessage& force = forces.back();
  EXPECT_EQ(force.tick, tick.tick);
  EXPECT_EQ(force.input_sequence, last_pose.sequence);
  EXPECT_EQ(force.input_stamp_ns, last_pose.stamp_ns);
  EXPECT_NEAR(force.forces.axial_n, 2, 1e-9);  // pushes the needle out
  EXPECT_NEAR(force.forces.lateral_n, 0, 1e-9);
  EXPECT_NEAR(force.forces.cutting_n + force.forces.friction_n, force.forces.axial_n, 1e-12);
}

TEST_F(ForceLinkTest, EveryForceCarriesItsTimeToLive) {
  attach();
  run(10);
  EXPECT_EQ(forces.back().valid_ms, 50);
  net::DeviceInfo slow;
  slow.limits.rate_hz = 10;
  attach(slow);
  run(300);
  EXPECT_EQ(forces.back().valid_ms, 250);
}

TEST_F(ForceLinkTest, OfALesserForceCuttingAndFrictionKeepTheirShares) {
  NeedleForces& tissue = tick.needles[0].forces;
  tissue.force_n = Vec3(6, 0, -4);
  tissue.axial_n = 4;
  tissue.lateral_n = 6;
  tissue.cutting_n = 3;
  tissue.friction_n = 1;
  attach();
  run(600);
  EXPECT_NEAR(forces.back().forces.axial_n, 2, 1e-9);
  EXPECT_NEAR(forces.back().forces.cutting_n, 1.5, 1e-9);
  EXPECT_NEAR(forces.back().forces.friction_n, 0.5, 1e-9);
}

struct Stall : ForceLinkTest, ::testing::WithParamInterface<int> {};

TEST_P(Stall, TakesTheForceAwayAndLatchesUntilArmed) {
  attach();
  run(600);
  is_sending = false;
  run(49);
  EXPECT_NEAR(hand().z(), -2, 1e-9);
  run(2);
  EXPECT_TRUE(link.gate(0).latched());
  EXPECT_EQ(told(Intervention::kStale), 1u);
  EXPECT_GT(hand().norm(), 0.9);  // on its way, no faster than 0.5 N/ms
  EXPECT_TRUE(flags() & net::kForceRamping);
  run(4);
  EXPECT_EQ(hand().norm(), 0);
  EXPECT_EQ(flags(), net::kForceLatched);
  run(GetParam() - 55);
  is_sending = true;
  run(1000);
  EXPECT_EQ(hand().norm(), 0);
  EXPECT_EQ(count(Intervention::kStale), 1u);
  EXPECT_EQ(events.size(), 1u);
  link.arm(0, "chief");
  EXPECT_EQ(events.size(), 2u);
  EXPECT_NE(events.back().text.find("armed by chief"), std::string::npos) << events.back().text;
  run(5);
  EXPECT_LT(hand().norm(), 0.05);
  run(600);
  EXPECT_NEAR(hand().z(), -2, 1e-9);
  EXPECT_LE(largest_step(), 0.5 + 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Milliseconds, Stall, ::testing::Values(100, 1000));

TEST_F(ForceLinkTest, AGapBetweenTwoPosesIsAStallAlsoWhereNoCycleCameInBetween) {
  attach();
  run(600);
  now_ns += 60 * kMs;
  link.pose_accepted(0, pose());
  EXPECT_TRUE(link.gate(0).latched());
}

TEST_F(ForceLinkTest, APoseThatIsNotFiniteTakesTheForceAwayWithinAFewMilliseconds) {
  attach();
  run(600);
  link.pose_not_finite(0);
  EXPECT_EQ(told(Intervention::kNotFinite), 1u);
  run(3);
  EXPECT_NEAR(hand().z(), -0.5, 1e-6);
  run(1);
  EXPECT_EQ(hand().norm(), 0);
  link.pose_not_finite(0);  // counted, but not announced again
  run(1000);
  EXPECT_EQ(hand().norm(), 0);
  EXPECT_EQ(told(Intervention::kNotFinite), 1u);
  EXPECT_EQ(count(Intervention::kNotFinite), 2u);
  link.arm(0, "hand");
  run(600);
  EXPECT_NEAR(hand().z(), -2, 1e-9);
  EXPECT_LE(largest_step(), 0.5 + 1e-9);
}

TEST_F(ForceLinkTest, ADeviceLostInContactLeavesNoForceToTheNextUntilItIsArmed) {
  attach();
  run(600);
  link.detach({});
  EXPECT_TRUE(link.gate(0).latched());
  EXPECT_EQ(told(Intervention::kDisconnected), 1u);
  EXPECT_TRUE(link.is_active());  // until its force is 0
  is_sending = false;
  run(10);
  EXPECT_FALSE(link.is_active());
  forces.clear();
  run(100);
  EXPECT_TRUE(forces.empty());

  is_sending = true;
  attach();
  EXPECT_NE(events.back().text.find("no force until it is armed"), std::string::npos) << events.back().text;
  run(1000);
  EXPECT_EQ(hand().norm(), 0);
  EXPECT_EQ(flags(), net::kForceLatched);
  link.arm(0, "hand");
  run(600);
  EXPECT_NEAR(hand().z(), -2, 1e-9);
  EXPECT_LE(largest_step(), 0.5 + 1e-9);
}

TEST_F(ForceLinkTest, ADeviceThatLeavesOutOfContactLeavesNoFault) {
  attach();
  tick.needles[0].is_in_contact = false;
  run(600);
  link.detach({});
  EXPECT_FALSE(link.gate(0).latched());
  EXPECT_TRUE(events.empty());
  tick.needles[0].is_in_contact = true;
  attach();
  run(600);
  EXPECT_NEAR(hand().z(), -2, 1e-9);
}

TEST_F(ForceLinkTest, ForcesComeAtTheDevicesRateAndAtMostEachMillisecond) {
  net::DeviceInfo device;
  for (const auto& [rate_hz, period_ms] : {std::pair(100.0, 10), {4000.0, 1}, {std::nan(""), 1}}) {
    device.limits.rate_hz = rate_hz;
    attach(device);
    EXPECT_EQ(link.period_ns(), period_ms * kMs);
    run(20);
    forces.clear();
    sent_ns.clear();
    run(1000);
    EXPECT_EQ(forces.size(), 1000u / static_cast<unsigned>(period_ms)) << rate_hz;
    for (std::size_t i = 1; i < sent_ns.size(); ++i) ASSERT_EQ(sent_ns[i] - sent_ns[i - 1], period_ms * kMs);
    EXPECT_LE(largest_step(), 0.5 + 1e-9);  // a slow one too: a step each
    link.detach(device);
    link.arm(0, "test");
  }
}

TEST_F(ForceLinkTest, ADeviceWithTheLocalModelGetsItEachTickScaledByTheRamp) {
  net::DeviceInfo device;
  device.evaluates_local_model = true;
  device.limits.rate_hz = 2000;
  attach(device);
  run(600);
  ASSERT_EQ(models.size(), 120u);
  EXPECT_EQ(forces.size(), 120u);  // for display
  EXPECT_LT(models.front().model.axial_stiffness_n_per_mm, 0.02 * kStiffness);
  EXPECT_EQ(models.front().flags, net::kForceArmed | net::kForceRamping);
  for (std::size_t i = 1; i < models.size(); ++i)
    ASSERT_GE(models[i].model.axial_stiffness_n_per_mm, models[i - 1].model.axial_stiffness_n_per_mm);
  const net::LocalModelMessage& model = models.back();
  EXPECT_EQ(model.model, tick.needles[0].model);
  EXPECT_EQ(model.flags, net::kForceArmed);
  EXPECT_EQ(model.input_sequence, last_pose.sequence);
  EXPECT_EQ(model.input_stamp_ns, last_pose.stamp_ns);
  EXPECT_EQ(model.max_force_n, kDefaultMaxForceN);
  EXPECT_EQ(model.max_stiffness_n_per_mm, 2 * kDefaultDampingNsPerMm * 2000);  // 2b/T: its own loop
  EXPECT_EQ(model.max_slew_n_per_ms, 0.5);
  EXPECT_EQ(model.ramp_s, 0.5);
  EXPECT_NEAR(hand().z(), -2, 1e-9);

  link.pose_not_finite(0);
  run(5);
  EXPECT_EQ(models.back().flags, net::kForceLatched);
  EXPECT_EQ(models.back().model.axial_stiffness_n_per_mm, 0);
  EXPECT_EQ(models.back().model.axial_max_n, 0);
}

TEST_F(ForceLinkTest, AModelOfAnotherDevicesPoseNamesNoPose) {
  net::DeviceInfo device;
  device.evaluates_local_model = true;
  attach(device);
  run(100);
  link.detach(device);
  attach(device);
  is_sending = false;
  run(10);
  EXPECT_EQ(models.back().input_sequence, 0u);
  EXPECT_EQ(models.back().input_stamp_ns, 0);
}

// A device that reconnects elsewhere: until a tick has used one of its poses, the last contact model is not its own.
TEST_F(ForceLinkTest, TheTissueWhereThePredecessorWasIsNotFelt) {
  attach();
  run(600);
  ASSERT_GT(hand().norm(), 1.5);
  tick.needles[0].is_in_contact = false;
  run(5);
  link.detach({});
  forces.clear();
  models.clear();
  net::DeviceInfo next;
  next.evaluates_local_model = true;
  attach(next);
  is_ticking = false;
  now_ns += kMs;
  link.pose_accepted(0, pose());
  ++tick.tick;  // of the old pose still
  link.on_tick(tick, now_ns);
  link.cycle(now_ns);
  ASSERT_FALSE(models.empty());
  EXPECT_FALSE(models.back().model.in_contact);
  for (int i = 0; i < 100; ++i) run(1);
  EXPECT_EQ(hand(), Vec3(Vec3::Zero()));
  is_ticking = true;
  run(600);
  EXPECT_TRUE(models.back().model.in_contact);
  EXPECT_GT(hand().norm(), 1.5);
}

TEST_F(ForceLinkTest, AFarClientGetsASofterTissueAndIsToldOnce) {
  round_trip_s = 0.03;
  attach();
  run(600);
  const double limit = 2 * kDefaultDampingNsPerMm / (0.001 + 2 * (0.03 + 0.001 + 0.001));
  EXPECT_LT(limit, kStiffness);
  EXPECT_NEAR(hand().z(), -20 * limit, 1e-9);
  EXPECT_TRUE(flags() & net::kForceLimited);
  EXPECT_EQ(told(Intervention::kStiffnessLimited), 1u);
  EXPECT_EQ(count(Intervention::kStiffnessLimited), 1u);
  round_trip_s.reset();  // an unknown round trip counts as long
  run(20);
  EXPECT_LT(hand().norm(), 20 * limit);
  net::StateMessage state;
  link.add_to(state);
  ASSERT_EQ(state.safety.size(), 1u);
  EXPECT_EQ(state.safety[0].code, static_cast<std::uint16_t>(Intervention::kStiffnessLimited));
  EXPECT_EQ(state.safety[0].count, 1u);
  EXPECT_EQ(link.interventions()[static_cast<std::size_t>(Intervention::kStiffnessLimited)], 1u);
}

TEST_F(ForceLinkTest, NoForceIsLargerThanTheDeviceTakes) {
  net::DeviceInfo device;
  attach(device);
  depth_mm = 60;
  run(600);
  EXPECT_NEAR(hand().norm(), kDefaultMaxForceN, 1e-9);
  EXPECT_TRUE(flags() & net::kForceLimited);
  EXPECT_EQ(told(Intervention::kForceLimited), 1u);
  link.detach(device);
  link.arm(0, "test");
  device.limits.max_force_n = 1;
  attach(device);
  forces.clear();
  run(600);
  EXPECT_NEAR(hand().norm(), 1, 1e-9);
  for (const net::ForceMessage& force : forces) ASSERT_LE(force.forces.force_n.norm(), 1 + 1e-9);
  EXPECT_EQ(told(Intervention::kForceLimited), 2u);  // once per connection
}

TEST_F(ForceLinkTest, ASimulationThatStopsTakesItsForceAlongWithoutAFault) {
  attach();
  run(600);
  is_ticking = false;
  run(60);
  EXPECT_EQ(hand().norm(), 0);
  EXPECT_TRUE(flags() & net::kForceExpired);
  EXPECT_FALSE(link.gate(0).latched());
  is_ticking = true;
  run(20);
  EXPECT_NEAR(hand().z(), -2, 1e-9);
  EXPECT_LE(largest_step(), 0.5 + 1e-9);
}

TEST_F(ForceLinkTest, AModelThatIsNotFiniteIsNone) {
  net::DeviceInfo device;
  device.evaluates_local_model = true;
  attach(device);
  run(600);
  tick.needles[0].model.lateral_n.x() = std::numeric_limits<double>::quiet_NaN();
  tick.needles[0].forces.force_n.x() = std::numeric_limits<double>::quiet_NaN();
  run(20);
  EXPECT_TRUE(is_usable(models.back().model));
  EXPECT_FALSE(models.back().model.in_contact);
  EXPECT_EQ(hand().norm(), 0);
  EXPECT_TRUE(forces.back().forces.hub_torque_nmm.allFinite());
  EXPECT_LE(largest_step(), 2.5);  // each tick, for display
}

struct TwoNeedles : ForceLinkTest {
  TwoNeedles() : ForceLinkTest(2) {}
};

TEST_F(TwoNeedles, AFaultOfOneLeavesTheOtherItsForce) {
  net::DeviceInfo zero, one;
  one.needle = 1;
  attach(zero);
  attach(one);
  link.pose_not_finite(1);
  run(600, 0);
  EXPECT_FALSE(link.gate(0).latched());
  EXPECT_TRUE(link.gate(1).latched());
  EXPECT_EQ(events.at(0).needle, 1);
  EXPECT_EQ(events[0].text.find("needle 1: pose has NaN"), 0u) << events[0].text;
  bool saw_zero = false;
  for (const net::ForceMessage& force : forces) {
    if (force.needle == 1) {
      ASSERT_EQ(force.forces.force_n.norm(), 0);
    } else {
      saw_zero |= std::abs(force.forces.force_n.z() + 2) < 1e-9;
    }
  }
  EXPECT_TRUE(saw_zero);
}

TEST_F(ForceLinkTest, TellsWhatWasNegotiatedAndWhatItDoesNotBelieve) {
  net::DeviceInfo device;
  device.evaluates_local_model = true;
  device.limits = {500, 2e4, 0.5, 1e9};
  attach(device);
  const std::uint32_t all = net::kForceNotPlausible | net::kStiffnessNotPlausible |
                            net::kDampingNotPlausible | net::kRateNotPlausible;
  EXPECT_EQ(link.negotiated(0), (net::NegotiatedLimits{3.3, 1, 0.0005, 1000, all}));
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NE(events[0].text.find("damping_n_s_per_mm 0.5 (at most 0.05; 1 N·s/m is 0.001)"),
            std::string::npos);
  link.detach(device);
  device.limits = {8, 0.25, 0.002, 4000};
  attach(device);
  EXPECT_EQ(link.negotiated(0), (net::NegotiatedLimits{8, 0.25, 0.002, 4000, 0}));
  EXPECT_EQ(events.size(), 1u);
}

TEST_F(ForceLinkTest, ADeviceThatLeavesWithoutAPoseIsNotLostInContact) {
  attach();
  run(20);
  link.detach({});  // in contact: a fault
  EXPECT_EQ(link.gate(0).count(Intervention::kDisconnected), 1u);
  link.arm(0, "chief");
  is_sending = false;
  attach();
  run(20);  // the needle is where the first device left it, in contact
  link.detach({});
  EXPECT_EQ(link.gate(0).count(Intervention::kDisconnected), 1u);
  EXPECT_FALSE(link.gate(0).latched());
}

}  // namespace
}  // namespace brachy
