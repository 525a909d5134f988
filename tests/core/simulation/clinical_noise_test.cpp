#include <gtest/gtest.h>

#include "core/simulation/clinical_noise.h"
#include "core/simulation/state_hash.h"
#include "tests/core/simulation/phantom_scene.h"

namespace brachy {
namespace {

NoiseSettings settings_on() {
  NoiseSettings settings;
  settings.on = true;
  settings.template_play_mm = 0.4;
  settings.tremor_mm = 0.1;
  settings.stop_s = 0.03;
  settings.drop_along_mm = 2;
  settings.drop_across_mm = 0.5;
  settings.migration_along_mm = 1.5;
  return settings;
}

struct Moments {
  double mean = 0, sd = 0;
};

Moments moments_of(const std::vector<double>& values) {
  Moments m;
  for (const double v : values) m.mean += v / static_cast<double>(values.size());
  for (const double v : values) m.sd += (v - m.mean) * (v - m.mean) / static_cast<double>(values.size());
  m.sd = std::sqrt(m.sd);
  return m;
}

TEST(ClinicalNoise, SeedsScatterAsTheSettingsSay) {
  const ClinicalNoise noise(settings_on(), 1);
  const Vec3 axis = Vec3(1, 2, 5).normalized();
  std::vector<double> along, across;
  for (std::uint32_t id = 1; id <= 20000; ++id) {
    const Vec3 offset = noise.drop_offset(id, axis);
    along.push_back(offset.dot(axis));
    across.push_back(offset.dot(axis.unitOrthogonal()));
  }
  // Along: a normal, and the half of one backwards, of mean σ√(2/π) and variance σ²(1 − 2/π).
  const double half = 2 / std::numbers::pi;
  EXPECT_NEAR(moments_of(along).mean, -1.5 * std::sqrt(half), 0.05);
  EXPECT_NEAR(moments_of(along).sd, std::sqrt(4 + 2.25 * (1 - half)), 0.05);
  EXPECT_NEAR(moments_of(across).mean, 0, 0.02);
  EXPECT_NEAR(moments_of(across).sd, 0.5, 0.02);
}

TEST(ClinicalNoise, EachInsertionIsDrawnByItself) {
  NoiseSettings settings = settings_on();
  settings.tremor_mm = 0;
  ClinicalNoise noise(settings, 2);
  std::vector<double> offsets;
  for (int insertion = 0; insertion < 4000; ++insertion) {
    const Vec3 first = noise.held(0, {}, 0, 0.005, true).p;
    EXPECT_EQ(noise.held(0, {}, 0.005, 0.005, true).p, first);  // the same all the way
    offsets.push_back(first.x());
    noise.held(0, {}, 0.01, 0.005, false);
  }
  EXPECT_NEAR(moments_of(offsets).sd, 0.4, 0.02);
  EXPECT_NEAR(moments_of(offsets).mean, 0, 0.02);
  EXPECT_NE(noise.held(1, {}, 0, 0.005, true).p, noise.held(0, {}, 0, 0.005, true).p);
}

// All needles alike, along each of them, and in every insertion: a push that makes up for it does so for good.
TEST(ClinicalNoise, CathetersDriftTogetherAlongThemselves) {
  NoiseSettings settings;
  settings.on = true;
  settings.template_play_mm = settings.tremor_mm = settings.stop_s = 0;
  settings.drift_mm = 1.8;
  std::vector<double> drifts;
  for (settings.seed = 1; settings.seed <= 4000; ++settings.seed) {
    ClinicalNoise noise(settings, 3);
    const Vec3 oblique = Vec3(1, 2, 4).normalized();
    const double drift = noise.held(0, {}, 0, 0.005, false).p.z();
    drifts.push_back(drift);
    const RigidTransform held = noise.held(2, test::pose_at({3, 2, 1}, oblique), 3, 0.005, true);
    EXPECT_LT((held.p - Vec3(3, 2, 1) - drift * oblique).norm(), 1e-12);
    noise.held(0, {}, 4, 0.005, true);
    noise.held(0, {}, 5, 0.005, false);
    EXPECT_EQ(noise.held(0, {}, 6, 0.005, true).p, Vec3(0, 0, drift));
  }
  EXPECT_NEAR(moments_of(drifts).mean, 0, 0.1);
  EXPECT_NEAR(moments_of(drifts).sd, 1.8, 0.06);
}

TEST(ClinicalNoise, TheHandTremblesSmoothly) {
  NoiseSettings settings = settings_on();
  settings.template_play_mm = 0;
  ClinicalNoise noise(settings, 1);
  std::vector<double> x;
  double steepest = 0;
  for (int tick = 0; tick < 20000; ++tick) {
    x.push_back(noise.held(0, {}, tick * 0.005, 0.005, false).p.x());
    if (tick > 0) steepest = std::max(steepest, std::abs(x[x.size() - 1] - x[x.size() - 2]));
  }
  EXPECT_NEAR(moments_of(x).sd, 0.1, 0.005);
  EXPECT_LT(steepest, 0.1);  // mm a tick
}

TEST(ClinicalNoise, AFastHandStopsLessExactly) {
  NoiseSettings settings = settings_on();
  settings.tremor_mm = 0;
  const auto stops = [&](double speed_mm_s) {
    ClinicalNoise noise(settings, 1);
    std::vector<double> z;
    for (int insertion = 0; insertion < 2000; ++insertion) {
      RigidTransform X_WN;
      for (int tick = 0; tick < 3; ++tick) {
        X_WN.p.z() = speed_mm_s * 0.005 * tick;
        z.push_back(noise.held(0, X_WN, 0, 0.005, true).p.z() - X_WN.p.z());
        if (tick < 2) z.pop_back();
      }
      noise.held(0, X_WN, 0, 0.005, false);
    }
    return moments_of(z).sd;
  };
  EXPECT_NEAR(stops(50), 0.03 * 50, 0.08);
  EXPECT_NEAR(stops(5), 0.03 * 5, 0.01);
}

std::uint64_t session_hash(const Scene& scene) {
  Simulator simulator(load_simulation_model(scene, load_tissue(scene).tissue));
  MeshState state = simulator.initial_state();
  StateHash hash;
  for (const RigidTransform& X_WN : test::insertion()) {
    simulator.step(test::needle_pose(X_WN), state);
    hash.add(state);
  }
  return hash.value();
}

TEST(ClinicalNoise, RepeatsBySeedAndDoesNothingWhereItIsOff) {
  Scene scene;
  scene.tissue.points = 2000;
  scene.model.kernel = "psi31";
  const std::uint64_t without = session_hash(scene);
  scene.noise.seed = 7;
  EXPECT_EQ(session_hash(scene), without);
  scene.noise.on = true;
  const std::uint64_t seven = session_hash(scene);
  EXPECT_EQ(session_hash(scene), seven);
  EXPECT_NE(seven, without);
  scene.noise.seed = 8;
  EXPECT_NE(session_hash(scene), seven);
}

}  // namespace
}  // namespace brachy
