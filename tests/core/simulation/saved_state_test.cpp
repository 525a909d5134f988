// A run is saved at random ticks and goes on from there in another simulator: with the same bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/scene/choice/choice.h"
#include "core/scene/file/scene_file.h"
#include "core/simulation/state_hash.h"
#include "test_paths.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/scene_count.h"

namespace brachy {
namespace {

using State = std::vector<std::byte>;

State saved_of(const Simulator& simulator) {
  State bytes;
  simulator.save(bytes);
  return bytes;
}

/// Poses of tick `k`: every needle of the scene goes in and out beside the others, later than the one before it, with
/// its button pressed now and then; a probe pushes from behind.
std::vector<NeedlePose> poses_at(const SimulationModel& model, const std::vector<RigidTransform>& way,
                                 std::size_t k) {
  std::vector<NeedlePose> poses;
  const std::size_t needles = model.settings.needle.count;
  for (std::size_t n = 0; n < needles; ++n) {
    const std::size_t at = k - std::min(k, 40 * n);
    NeedlePose pose = test::needle_pose(way[std::min(at, way.size() - 1)]);
    pose.X_WN.p.x() -= 5.0 * static_cast<double>(n % 5);
    pose.X_WN.p.y() += 5.0 * static_cast<double>(n / 5);
    pose.sequence = k;
    pose.button = at % 100 > 80;
    poses.push_back(pose);
  }
  if (model.settings.probe.on) {
    const double pushed_mm = 0.02 * static_cast<double>(std::min<std::size_t>(k, 200));
    poses.push_back(test::needle_pose(test::pose_at({0, -35 + pushed_mm, 10}, Vec3::UnitZ())));
  }
  return poses;
}

std::uint64_t hash_of(const MeshState& state) {
  StateHash hash;
  hash.add(state);
  return hash.value();
}

/// Runs the scene, saves it after `saves` random ticks, and goes on from each for `further` ticks.
void goes_on_alike(const Scene& scene, int saves, std::size_t further) {
  const auto model = load_simulation_model(scene, load_tissue(scene).tissue);
  std::vector<RigidTransform> way;
  const auto all = test::insertion();
  for (std::size_t k = 0; k < all.size(); k += 2) way.push_back(all[k]);
  const std::size_t ticks = way.size() + 40 * (model->settings.needle.count - 1);
  std::mt19937_64 random(9);
  std::map<std::size_t, State> saved;
  for (int i = 0; i < saves; ++i) saved[random() % (ticks - 1)];

  Simulator simulator(model);
  MeshState state = simulator.initial_state();
  std::vector<std::uint64_t> hashes;
  std::uint64_t spread_ticks = 0;
  for (std::size_t k = 0; k < ticks; ++k) {
    simulator.step(poses_at(*model, way, k), state);
    hashes.push_back(hash_of(state));
    // Besides, where a model spreads its work over ticks: some of those while it does, and after.
    const auto& counts = simulator.evaluation_counts();
    const std::uint64_t spread =
        counts[std::size_t(Evaluation::kMixed)] + counts[std::size_t(Evaluation::kCondensed)];
    const bool is_spread = std::exchange(spread_ticks, spread) < spread && spread % 7 == 1 && spread < 30;
    if (saved.contains(k) || is_spread) saved[k] = saved_of(simulator);
  }
  for (const auto& [last, bytes] : saved) {
    Simulator again(model);
    again.restore(bytes);
    ASSERT_EQ(saved_of(again), bytes) << "saved in tick " << last;
    MeshState slot = again.initial_state();
    for (std::size_t k = last + 1; k < std::min(ticks, last + 1 + further); ++k) {
      again.step(poses_at(*model, way, k), slot);
      ASSERT_EQ(hash_of(slot), hashes[k]) << "saved in tick " << last << ", tick " << k;
    }
  }
}

class ShippedScene : public ::testing::TestWithParam<std::string> {};

/// The scenes of config; of the exercises', which are much alike, two, and in a campaign all.
std::vector<std::string> shipped_scenes() {
  std::vector<std::string> names = {"prostate", "prostate_1khz", "three_needles", "perineum",
                                    "theatre",  "session",       "hdr",           "million_points"};
  for (const auto& file : std::filesystem::directory_iterator(BRACHY_CONFIG_DIR "/exercises/scenes")) {
    const std::string name = file.path().stem().string();
    if (test::is_campaign() || name == "10_with_swelling" || name == "11_volume_study")
      names.push_back("exercises/scenes/" + name);
  }
  std::ranges::sort(names);
  return names;
}

TEST_P(ShippedScene, GoesOnFromAnyTickWithTheSameBits) {
  Scene scene = with_choice(load_scene(std::string(BRACHY_CONFIG_DIR "/") + GetParam() + ".toml"));
  if (!test::is_campaign()) scene.tissue.points = std::min<std::uint64_t>(scene.tissue.points, 6000);
  goes_on_alike(scene, test::scene_count(3), 40);
}

INSTANTIATE_TEST_SUITE_P(Saved, ShippedScene, testing::ValuesIn(shipped_scenes()), [](const auto& scene) {
  return std::filesystem::path(scene.param).filename().string();
});

class SavedModel : public ::testing::TestWithParam<const char*> {};

TEST_P(SavedModel, GoesOnFromAnyTickWithTheSameBits) {
  Scene scene;
  scene.tissue.points = 4000;
  scene.model.kernel = GetParam();
  scene.needle.count = 2;
  scene.probe.on = scene.model.kernel == std::string("elastic") || scene.model.kernel == std::string("fem");
  goes_on_alike(scene, test::scene_count(4), 60);
}

INSTANTIATE_TEST_SUITE_P(Saved, SavedModel,
                         testing::Values("psi31", "buhmann", "compact_elastic", "elastic", "fem"),
                         [](const auto& name) { return std::string(name.param); });

// Many needles stirred: ticks whose field is still due, and blocks that are late.
TEST(SavedState, GoesOnWhereWorkIsUnfinished) {
  Scene scene;
  scene.needle.count = 6;
  scene.work_costs = WorkCosts{}.slower_by(2);
  const auto model = load_simulation_model(scene, load_tissue(scene).tissue);
  Simulator simulator(model);
  MeshState state = simulator.initial_state();
  const auto poses = [&](int k) {
    std::vector<NeedlePose> all;
    for (int n = 0; n < 6; ++n) {
      const double depth = std::min(12.0, -40 + 0.5 * k), stirred = depth < 12 ? 0 : 3 * std::sin(0.2 * k);
      all.push_back(test::needle_pose(test::pose_at({-12.0 + 5 * n + stirred, -4, depth}, Vec3::UnitZ())));
    }
    return all;
  };
  int late = 0, k = 0;
  for (; k < 400 && late < 3; ++k) {
    simulator.step(poses(k), state);
    if (!(state.summary.step_flags & kStepLate)) continue;
    ++late;
    Simulator again(model);
    again.restore(saved_of(simulator));
    Simulator same(model);
    same.restore(saved_of(again));
    MeshState slot = again.initial_state(), other = same.initial_state();
    for (int further = 1; further <= 20; ++further) {
      again.step(poses(k + further), slot);
      same.step(poses(k + further), other);
      ASSERT_EQ(hash_of(slot), hash_of(other));
    }
  }
  EXPECT_EQ(late, 3);
  const State bytes = saved_of(simulator);
  Simulator again(model);
  again.restore(bytes);
  MeshState slot = again.initial_state();
  for (; k < 440; ++k) {
    simulator.step(poses(k), state);
    again.step(poses(k), slot);
    ASSERT_EQ(hash_of(slot), hash_of(state)) << k;
  }
}

TEST(SavedState, IsRefusedWhereItIsNotWholeOrAnothers) {
  Scene scene;
  scene.tissue.points = 2000;
  const auto model = load_simulation_model(scene, load_tissue(scene).tissue);
  Simulator simulator(model);
  MeshState state = simulator.initial_state();
  for (double z = -40; z <= 0; z += 0.5)
    simulator.step(test::needle_pose(test::pose_at({8, -4, z}, Vec3::UnitZ())), state);
  const State bytes = saved_of(simulator);
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 3)
    EXPECT_THROW(Simulator(model).restore(std::span(bytes).first(size)), UserError) << size;
  State longer = bytes;
  longer.push_back({});
  EXPECT_THROW(Simulator(model).restore(longer), UserError);
  State other = bytes;
  other[0] = std::byte{1};
  EXPECT_THROW(Simulator(model).restore(other), UserError);
}

// Whatever a tick depends on makes another scene; what it does not, none.
TEST(SavedState, IsRefusedInAnotherSceneAlsoWhereAllIsOfTheSameSize) {
  const auto model_of = [](const Scene& scene) {
    return load_simulation_model(scene, load_tissue(scene).tissue);
  };
  using Changes = std::vector<std::function<void(Scene&)>>;
  const auto are_all_refused = [&](const std::string& kernel, const Changes& changes) {
    Scene scene;
    scene.tissue.points = 1500;
    scene.model.kernel = kernel;
    const State bytes = saved_of(Simulator(model_of(scene)));
    for (std::size_t i = 0; i < changes.size(); ++i) {
      Scene other = scene;
      changes[i](other);
      EXPECT_THROW(Simulator(model_of(other)).restore(bytes), UserError) << kernel << ", change " << i;
    }
    scene.name = "another name";
    scene.engine.threads = 2;
    scene.dose.spacing_mm = 3;
    Simulator(model_of(scene)).restore(bytes);
  };
  are_all_refused("psi31", {
                               [](Scene& s) { s.model.kernel = "psi32"; },
                               [](Scene& s) { s.model.support_radius_mm += 1; },
                               [](Scene& s) { s.tissue.shear_modulus_kpa *= 1.01; },
                               [](Scene& s) { s.tissue.poisson = 0.48; },
                               [](Scene& s) { s.tissue.seed += 1; },
                               [](Scene& s) { s.tissue.contact.cutting_force_n = 2.9; },
                               [](Scene& s) { s.stability.max_substeps -= 1; },
                               [](Scene& s) { s.anchors.lambda_rest = 0.6; },
                               [](Scene& s) { s.needle.diameter_mm = 1.2; },
                               [](Scene& s) { s.needle.count = 2; },
                               [](Scene& s) { s.contact.relaxation_share = 0.5; },
                               [](Scene& s) { s.swelling.on = true; },
                               [](Scene& s) { s.noise.seed += 1; },
                               [](Scene& s) { s.template_grid.origin_mm.x() += 1; },
                               [](Scene& s) { s.seeds.loading = "order"; },
                               [](Scene& s) { s.rates.deformation_hz = 100; },
                               [](Scene& s) { s.work_costs.landmark_s *= 2; },
                               [](Scene& s) {
                                 s.regions.emplace_back().semi_axes_mm = Vec3::Constant(5);
                                 s.regions.back().support_radius_mm = 10;
                               },
                           });
  are_all_refused("compact_elastic", {
                                         [](Scene& s) { s.model.kernel = "elastic"; },
                                         [](Scene& s) { s.box.size_mm.x() += 1; },
                                         [](Scene& s) { s.box.centre_mm.x() += 1; },
                                         [](Scene& s) { s.box.held[0] = !s.box.held[0]; },
                                     });
  are_all_refused("elastic", {
                                 [](Scene& s) { s.needle.flexible = true; },
                                 [](Scene& s) { s.gland.moves = true; },
                                 [](Scene& s) { s.probe.on = true; },
                                 [](Scene& s) {
                                   s.regions.emplace_back().semi_axes_mm = Vec3::Constant(5);
                                   s.regions.back().shear_modulus_kpa = 30;
                                 },
                             });
}

}  // namespace
}  // namespace brachy
