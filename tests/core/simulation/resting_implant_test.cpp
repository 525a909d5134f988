// Implants of many needles come to rest: what was left undecided while they moved is decided then.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <tuple>

#include "tests/core/injectivity/random_scene.h"
#include "tests/core/models/deformation_gradient.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/scene_count.h"

namespace brachy {
namespace {

constexpr int kInsertTicks = 100, kAsideTicks = 50;

/// Needles in random holes of a template with 5 mm between them, at random depths, each pushed aside up to 1.5 mm.
class RandomImplant {
 public:
  RandomImplant(test::RandomScenes& random, std::size_t needles) {
    constexpr double kPitch = 5, kWidest = 18;
    std::vector<Vec3> holes;
    for (int i = -3; i <= 3; ++i)
      for (int j = -3; j <= 3; ++j)
        if (Vec3 hole = kPitch * Vec3(i, j, 0); hole.norm() <= kWidest) holes.push_back(hole);
    for (std::size_t n = 0; n < needles; ++n) {
      const auto other =
          n + static_cast<std::size_t>(random.uniform() * static_cast<double>(holes.size() - n));
      std::swap(holes[n], holes[other]);
      places_.push_back(holes[n] + random.between(-5, 15) * Vec3::UnitZ());
      aside_.push_back(Vec3(random.between(-1.5, 1.5), random.between(-1.5, 1.5), 0));
    }
  }

  std::vector<NeedlePose> at(int tick) const {
    const double in = std::min(1.0, static_cast<double>(tick) / kInsertTicks),
                 pushed = std::clamp(static_cast<double>(tick - kInsertTicks) / kAsideTicks, 0.0, 1.0);
    std::vector<NeedlePose> poses;
    for (std::size_t n = 0; n < places_.size(); ++n) {
      Vec3 tip = places_[n] + pushed * aside_[n];
      tip.z() = -45 + in * (tip.z() + 45);
      poses.push_back(test::needle_pose(test::pose_at(tip, Vec3::UnitZ())));
    }
    return poses;
  }

 private:
  std::vector<Vec3> places_, aside_;
};

std::shared_ptr<const SimulationModel> model_of(std::size_t needles) {
  Scene scene;
  scene.needle.count = needles;
  return load_simulation_model(scene, load_tissue(scene).tissue);
}

bool is_in_a_needle(const Vec3& X, const LandmarkSet& landmarks) {
  constexpr double kWithin = 4;
  return std::ranges::any_of(landmarks.positions,
                             [&](const Vec3& p) { return (X - p).head<2>().norm() < kWithin; });
}

TEST(RestingImplant, IsDecidedWithinASecondAndRightly) {
  constexpr int kTicks = 200;  // 1 s
  constexpr std::array<std::size_t, 4> kNeedles = {3, 8, 14, 20};
  test::RandomScenes random(7);
  std::vector<int> ticks_taken;
  const int implants = test::scene_count(2);
  for (int i = 0; i < implants; ++i) {
    const std::size_t needles = test::is_campaign() ? 1 + static_cast<std::size_t>(random.uniform() * 20)
                                                    : kNeedles[static_cast<std::size_t>(i) % kNeedles.size()];
    SCOPED_TRACE(std::to_string(i) + ": " + std::to_string(needles) + " needles");
    const RandomImplant implant(random, needles);
    Simulator simulator(model_of(needles));
    MeshState state = simulator.initial_state();
    for (int k = 0; k < kInsertTicks + kAsideTicks; ++k) simulator.step(implant.at(k), state);
    const Certificate& certificate = state.summary.certificate;
    int taken = 0;
    do simulator.step(implant.at(kInsertTicks + kAsideTicks), state);
    while (++taken < kTicks && certificate.verdict == Verdict::kUnknown);
    ticks_taken.push_back(taken);
    EXPECT_NE(certificate.verdict, Verdict::kUnknown);
    EXPECT_EQ(certificate.verdict == Verdict::kUnknown, (state.summary.step_flags & kStepUncertified) != 0);
    if (certificate.verdict == Verdict::kFolded) {
      EXPECT_LT(test::deformation_gradient(simulator.field(), certificate.place).determinant(), 0.05);
      continue;
    }
    EXPECT_GT(certificate.det_bound, 0);
    for (int k = 0; k < 2000; ++k) {
      const Vec3 X = random.between(0, 22) * random.direction();
      if (is_in_a_needle(X, simulator.landmarks())) continue;
      EXPECT_GE(test::deformation_gradient(simulator.field(), X).determinant(), certificate.det_bound) << X;
    }
  }
  std::ranges::sort(ticks_taken);
  std::cout << "decided after " << ticks_taken[ticks_taken.size() / 2] << " ticks at the median, "
            << ticks_taken.back() << " at most; within 1 s "
            << std::ranges::count_if(ticks_taken, [](int ticks) { return ticks <= 200; }) << " of "
            << ticks_taken.size() << "\n";
}

// A search that goes on from tick to tick is part of the state.
TEST(RestingImplant, GoesOnFromASavedStateWithTheSameBits) {
  test::RandomScenes random(11);
  const RandomImplant implant(random, 12);
  const auto model = model_of(12);
  Simulator simulator(model);
  MeshState state = simulator.initial_state();
  const auto certificate_of = [](const MeshState& s) {
    const Certificate& c = s.summary.certificate;
    return std::tuple(c.verdict, c.det_bound == c.det_bound ? c.det_bound : -1, c.vertex_det);
  };
  for (int k = 0; k < kInsertTicks + kAsideTicks + 20; ++k) simulator.step(implant.at(k), state);
  ASSERT_EQ(state.summary.certificate.verdict, Verdict::kUnknown);
  std::vector<std::byte> bytes;
  simulator.save(bytes);
  Simulator again(model);
  again.restore(bytes);
  MeshState slot = again.initial_state();
  int decided = 0;
  for (int k = 0; k < 200; ++k) {
    simulator.step(implant.at(kInsertTicks + kAsideTicks), state);
    again.step(implant.at(kInsertTicks + kAsideTicks), slot);
    ASSERT_EQ(certificate_of(slot), certificate_of(state)) << k;
    decided += state.summary.certificate.verdict != Verdict::kUnknown;
  }
  EXPECT_GT(decided, 0);
}

}  // namespace
}  // namespace brachy
