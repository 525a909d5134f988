// A hand drives the device through a capsule, into tissue, to and fro, sideways and out, over a network with delay and
// loss of poses: the force must neither oscillate nor jump.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "haptics/force/negotiation.h"
#include "haptics/simulated/hand_report.h"
#include "haptics/simulated/simulated_loop.h"
#include "tests/haptics/simulated/tissue_model.h"

namespace brachy {
namespace {

using test::TissueModel;

/// In at 30 mm/s, to and fro by 3 mm at 1 Hz and sideways by 1 mm, out: 7 s.
Vec3 hand_at(double t) {
  if (t < 1.5) return Vec3(0, 0, -10 + 30 * t);
  if (t < 5.5) {
    const double phase = 2 * std::numbers::pi * (t - 1.5);
    return Vec3(std::sin(0.5 * phase), 0, 35 + 3 * std::sin(phase));
  }
  return Vec3(0, 0, std::max(-15.0, 35 - 60 * (t - 5.5)));
}

struct Ride {
  HandReport report;
  bool was_inside = false;
  double deepest = -INFINITY;
};

Ride ride(LoopSettings settings, TissueModel tissue = {}) {
  settings.limits = negotiate(
      {.damping_n_s_per_mm = settings.device.damping_n_s_per_mm},
      {.period_s = 1 / settings.device.rate_hz,
       .delay_s = settings.local_model ? 0 : wire_delay_s(2 * settings.delay_s, 1 / settings.wire_hz)});
  Ride ride;
  SimulatedLoop loop(settings, [&](const NeedlePose& pose) { return tissue(pose); },
                     {Mat3::Identity(), hand_at(0)});
  const double period_s = 1 / settings.device.rate_hz;
  while (loop.time_s() < 7) {
    const double t_s = loop.time_s();
    const Vec3 force_n = loop.step({Mat3::Identity(), hand_at(t_s + period_s)});
    ride.report.add(t_s, period_s, force_n, loop.device().tip() - loop.device().hand());
    ride.was_inside = ride.was_inside || tissue.inside();
    ride.deepest = std::max(ride.deepest, loop.device().tip().z());
  }
  return ride;
}

struct Network {
  double delay_s;
  std::uint64_t seed;
};

class DelayedHand : public testing::TestWithParam<Network> {};

LoopSettings over(const Network& network) {
  LoopSettings s;
  s.delay_s = network.delay_s;
  s.drop_share = 0.01;
  s.seed = network.seed;
  return s;
}

TEST_P(DelayedHand, NeitherRingsNorJumps) {
  const Ride r = ride(over(GetParam()));
  EXPECT_FALSE(r.report.oscillated()) << r.report.oscillated_at_s();
  EXPECT_LE(r.report.largest_jump_n_per_ms(), 0.5 + 1e-9);
  EXPECT_TRUE(r.was_inside);
  EXPECT_GT(r.deepest, 25);
  EXPECT_GT(r.report.peak_force_n(), 1.5);
}

TEST_P(DelayedHand, NeitherRingsNorJumpsWithAFirmGripOrNone) {
  LoopSettings firm = over(GetParam());
  firm.device.hand_stiffness_n_per_mm = 1;
  EXPECT_FALSE(ride(firm).report.oscillated());
  LoopSettings loose = over(GetParam());
  loose.device.hand_stiffness_n_per_mm = 0.05;
  loose.device.hand_damping_n_s_per_mm = 0.001;
  const Ride r = ride(loose);
  EXPECT_FALSE(r.report.oscillated()) << r.report.oscillated_at_s();
  EXPECT_LE(r.report.largest_jump_n_per_ms(), 0.5 + 1e-9);
}

TEST_P(DelayedHand, ASimpleClientNeitherRingsNorJumps) {
  LoopSettings simple = over(GetParam());
  simple.local_model = false;
  const Ride r = ride(simple);
  EXPECT_FALSE(r.report.oscillated()) << r.report.oscillated_at_s();
  EXPECT_LE(r.report.largest_jump_n_per_ms(), 0.5 + 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Delays, DelayedHand,
                         testing::Values(Network{0, 1}, Network{0.005, 1}, Network{0.005, 2},
                                         Network{0.01, 1}, Network{0.01, 2}, Network{0.02, 1},
                                         Network{0.02, 2}, Network{0.05, 1}, Network{0.05, 2},
                                         Network{0.05, 3}),
                         [](const auto& tried) {
                           return std::to_string(std::lround(1e3 * tried.param.delay_s)) + "MsSeed" +
                                  std::to_string(tried.param.seed);
                         });

// The tests above must detect a loop that does ring: a stiff spring over the wire without negotiation.
TEST(DelayedHandMeter, SeesALoopThatRings) {
  LoopSettings wire;
  wire.local_model = false;
  wire.delay_s = 0.02;
  wire.device.hand_stiffness_n_per_mm = 0.05;
  wire.device.hand_damping_n_s_per_mm = 0.0005;
  TissueModel tissue;
  SimulatedLoop loop(wire, [&](const NeedlePose& pose) { return tissue(pose); }, {});
  HandReport report;
  for (int i = 0; i < 4000; ++i) {
    const double t_s = loop.time_s();
    const Vec3 force_n = loop.step({Mat3::Identity(), Vec3(0, 0, std::min(20.0, 30 * t_s))});
    report.add(t_s, 0.001, force_n, loop.device().tip() - loop.device().hand());
  }
  EXPECT_TRUE(report.oscillated());
}

TEST(SwingMeter, TellsRingingFromDyingAwayAndFromMoving) {
  const auto rang = [](auto&& motion) {
    SwingMeter meter(0.05);
    for (int i = 0; i < 3000; ++i) meter.add(motion(1e-3 * i), 1e-3 * i);
    return meter.rang();
  };
  const double w = 2 * std::numbers::pi * 10;
  EXPECT_TRUE(rang([&](double t) { return 5 * t + 0.2 * std::sin(w * t); }));
  EXPECT_TRUE(rang([&](double t) { return 0.01 * std::exp(2 * t) * std::sin(w * t); }));
  EXPECT_FALSE(rang([&](double t) { return std::exp(-2 * t) * std::sin(w * t); }));
  EXPECT_FALSE(rang([&](double t) { return 0.02 * std::sin(w * t); })) << "within the encoder's steps";
  EXPECT_FALSE(rang([](double t) { return 10 * std::sin(2 * std::numbers::pi * t); }))
      << "a hand that goes to and fro";
}

}  // namespace
}  // namespace brachy
