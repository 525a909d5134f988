#include "apps/daemon/loops/ultrasound_scanner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "core/scene/load_simulation_model.h"
#include "core/scene/load_structures.h"
#include "core/scene/load_tissue.h"
#include "core/scene/load_ultrasound.h"
#include "core/simulation/simulator.h"
#include "tests/core/simulation/allocation_guard.h"

namespace brachy {
namespace {

Scene small_scene() {
  Scene scene;
  scene.model.kernel = "psi31";
  scene.tissue.points = 3000;
  scene.tissue.phantom_surface_vertices = 400;
  scene.ultrasound.width_px = scene.ultrasound.height_px = 128;
  scene.ultrasound.lines = 96;
  return scene;
}

/// A simulation that a needle has been pushed into, and a scanner beside it.
struct UltrasoundScannerTest : ::testing::Test {
  UltrasoundScannerTest() {
    settings.settings = scene.ultrasound;
    settings.demand = {true, true, true};
    scanner.set(settings);
    advance(-30, 8);
  }
  void advance(double from_z, double to_z) {
    for (double z = from_z; z <= to_z; z += 0.5) step(z);
  }
  void step(double z) {
    NeedlePose pose;
    pose.present = true;
    pose.sequence = ++sequence;
    pose.X_WN.p = Vec3(4, 2, z);
    simulator.step(pose, state);
    EXPECT_TRUE(tick.copy_from(simulator, state));
  }
  bool scan(std::size_t view = 0) { return scanner.take(tick, model) && scanner.scan(tick, view, image); }

  Scene scene = small_scene();
  Simulator simulator{load_simulation_model(scene, load_tissue(scene).tissue)};
  MeshState state = simulator.initial_state();
  ImagedTick tick{simulator, state};
  std::uint64_t sequence = 0;
  std::shared_ptr<const EchoMap> echoes = load_echo_map(scene, load_structures(scene));
  RigidTransform X_WR = resting_probe(scene, simulator.tissue());
  ScannerSettings settings;
  RunModel model{0, simulator.model()};
  UltrasoundScanner scanner{scene, echoes, X_WR};
  ScannedImage image;
};

TEST_F(UltrasoundScannerTest, ItsImageIsThatOfTheSimulatorsOwnField) {
  ASSERT_GT(state.summary.max_displacement_mm, 0.5);
  ASSERT_TRUE(scan());
  UltrasoundImager imager(imager_options(scene), echoes);
  ASSERT_EQ(imager.render({simulator.field(), simulator.body_frame(), state.summary.certificate.verdict,
                           state.summary.tick, state.needles.states, state.seeds.in_tissue(), X_WR}),
            ImageResult::kNew);
  EXPECT_TRUE(std::ranges::equal(image.plain.data, imager.pixels()));
  EXPECT_TRUE(image.plain.X_WI == imager.image_pose());
  EXPECT_EQ(image.plain.tick, state.summary.tick);
  EXPECT_EQ(image.plain.flags, 0);
  EXPECT_GT(std::set(image.plain.data.begin(), image.plain.data.end()).size(), 50u) << "it is an image";
  std::vector<std::uint8_t> unpacked;
  EXPECT_EQ(net::read_pixels(image.packed, unpacked), "");
  EXPECT_EQ(unpacked, image.plain.data);
}

TEST_F(UltrasoundScannerTest, TheGlandOfItsImageIsWhereTheSimulatorHasIt) {
  EXPECT_EQ(scanner.deformed({Vec3::Zero()}), nullptr) << "there is no image yet";
  ASSERT_TRUE(scan());
  const Tissue& tissue = simulator.tissue();
  const auto gland = scanner.deformed({tissue.rest_vertices.begin(), tissue.rest_vertices.begin() + 400});
  ASSERT_TRUE(gland);
  EXPECT_EQ(gland->tick, state.summary.tick);
  constexpr double kRoundingMm = 1e-4;
  double moved = 0;
  for (std::size_t i = 0; i < gland->vertices.size(); ++i) {
    const float* v = &state.mesh.deformed_vertices[3 * i];
    EXPECT_NEAR((gland->vertices[i] - Vec3(v[0], v[1], v[2])).norm(), 0, kRoundingMm);
    moved = std::max(moved, (gland->vertices[i] - tissue.rest_vertices[i]).norm());
  }
  EXPECT_GT(moved, 500 * kRoundingMm) << "the gland at rest would pass as well";
}

TEST_F(UltrasoundScannerTest, AnImageAllocatesNothingOnceThereWasOne) {
  if (!test::allocations_are_counted()) GTEST_SKIP() << "the sanitizer owns malloc";
  ASSERT_TRUE(scan());
  advance(8, 10);
  const std::uint64_t before = test::allocation_count();
  const bool is_copied = tick.copy_from(simulator, state);
  const bool is_scanned = scan();
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_TRUE(is_copied && is_scanned);
}

TEST_F(UltrasoundScannerTest, AnImageWhoseRunHasNoModelYetIsTheLastOneAndHeld) {
  ASSERT_TRUE(scan());
  const auto pixels = image.plain.data;
  const std::uint64_t shown = image.plain.tick;
  step(8.5);
  tick.run = 1;
  EXPECT_FALSE(scanner.take(tick, model));
  ASSERT_TRUE(scanner.scan(tick, 0, image));
  EXPECT_EQ(image.plain.flags, net::kImageHeld);
  EXPECT_EQ(image.plain.tick, shown);
  EXPECT_EQ(image.plain.newest_tick, shown + 1);
  EXPECT_EQ(image.plain.data, pixels);
  model.run = 1;
  ASSERT_TRUE(scan());
  EXPECT_EQ(image.plain.flags, 0);
}

TEST_F(UltrasoundScannerTest, WithoutAnyImageThereIsNothingToHoldOrRepeat) {
  tick.run = 1;
  EXPECT_FALSE(scanner.take(tick, model));
  EXPECT_FALSE(scanner.scan(tick, 0, image));
  EXPECT_FALSE(scanner.repeat(tick, 0, image));
}

TEST_F(UltrasoundScannerTest, AFrozenImageIsRepeatedAsItWas) {
  ASSERT_TRUE(scan());
  const auto pixels = image.plain.data;
  const std::uint64_t number = image.plain.sequence;
  step(8.5);
  ASSERT_TRUE(scanner.repeat(tick, 0, image));
  EXPECT_EQ(image.plain.flags, net::kImageFrozen);
  EXPECT_EQ(image.plain.data, pixels);
  EXPECT_EQ(image.plain.sequence, number + 1);
}

TEST_F(UltrasoundScannerTest, BiplaneHasBothArraysAcrossEachOther) {
  settings.is_biplane = true;
  ++settings.version;
  scanner.set(settings);
  ASSERT_EQ(scanner.views(), 2u);
  ASSERT_TRUE(scan(0));
  const RigidTransform transverse = image.plain.X_WI;
  EXPECT_EQ(image.plain.array, net::ScannerArray::kTransverse);
  ASSERT_TRUE(scan(1));
  EXPECT_EQ(image.plain.array, net::ScannerArray::kSagittal);
  EXPECT_NEAR(transverse.R.col(2).dot(image.plain.X_WI.R.col(2)), 0, 1e-12);
}

TEST_F(UltrasoundScannerTest, TheStepperMovesThePlaneOfAProbeWithoutAPose) {
  ASSERT_TRUE(scan());
  const Vec3 before = image.plain.X_WI.p;
  settings.place = {5, 0};
  scanner.set(settings);
  for (int i = 0; i < 20; ++i) scanner.move(0.033);
  ASSERT_TRUE(scan());
  EXPECT_TRUE((image.plain.X_WI.p - before).isApprox(Vec3(0, 0, 5), 1e-9));
}

TEST_F(UltrasoundScannerTest, OfATickWhoseSolveFailedNothingIsTaken) {
  const std::uint64_t taken = tick.tick;
  state.summary.step_flags |= kStepSolveFailed;
  ++state.summary.tick;
  EXPECT_FALSE(tick.copy_from(simulator, state));
  EXPECT_EQ(tick.tick, taken);
}

}  // namespace
}  // namespace brachy
