// The image against the simulation: places, material points, the same pixels, no allocation.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/base/error.h"
#include "core/geometry/surface/surface_bvh.h"
#include "tests/core/simulation/allocation_guard.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/core/ultrasound/ultrasound_testing.h"

namespace brachy {
namespace {

using test::apart;
using test::FunctionField;
using test::needle_pose;
using test::plain_options;
using test::pressure_at;
using test::spot_near;

const auto kNoMotion = [](const Vec3&) { return Vec3(Vec3::Zero()); };

UltrasoundImager::Options bright(const std::string& array) {
  UltrasoundImager::Options options = plain_options(array);
  options.settings.needle_echo_db = options.settings.seed_echo_db = 45;
  options.settings.shadow_db = 0;
  return options;
}

TEST(UltrasoundImage, DrawsSeedsAndNeedlesWhereTheirSurfaceFacesTheProbe) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> in(-1, 1);
  UltrasoundImager imager(bright("transverse"), std::make_shared<EchoMap>());
  FunctionField field(kNoMotion);
  const RigidTransform X_WI = test::probe_below() * imager.plane().in_probe();
  for (int k = 0; k < 40; ++k) {
    const double a = 20 * in(random);
    const PlanePoint centre{a, 34 + 14 * in(random)};
    const PlanePoint beam = imager.plane().beam(imager.plane().find(centre).line);
    const Vec3 p_W = X_WI * Vec3(centre.a, centre.b, 0);
    const bool is_seed = k % 2 == 0;
    const double radius = is_seed ? 0.4 : 0.635;
    std::vector<Seed> seeds(is_seed ? 1 : 0);
    std::vector<NeedleState> needles(is_seed ? 0 : 1);
    for (Seed& seed : seeds) seed.position = p_W;
    for (NeedleState& needle : needles) {
      needle.present = true;
      needle.X_WN.p = p_W + Vec3(0, 0, 30);
    }
    ASSERT_EQ(test::render(imager, field, needles, seeds), ImageResult::kNew);
    const PlanePoint surface{centre.a - radius * beam.a, centre.b - radius * beam.b};
    EXPECT_LE(apart(spot_near(imager, surface, 1.5), surface), 0.2) << k;
  }
}

// A catheter that turns by 20 to 60° between the plane and its tip; a straight needle would be drawn 5 to 15 mm beside.
TEST(UltrasoundImage, DrawsACurvedCatheterWhereItPassesThePlane) {
  UltrasoundImager imager(bright("transverse"), std::make_shared<EchoMap>());
  FunctionField field(kNoMotion);
  const RigidTransform X_WI = test::probe_below() * imager.plane().in_probe();
  for (int k = 0; k < 9; ++k) {
    const PlanePoint centre{-8 + 2.0 * k, 30 + 1.0 * k};
    const PlanePoint beam = imager.plane().beam(imager.plane().find(centre).line);
    const double behind = 31 + 1.5 * k, bend = (20.0 + 5 * k) / behind * M_PI / 180;  // for each mm
    const auto arc = [&](double s) {  // along +z in the plane, and aside from there to the tip
      const double t = bend * (behind - s);
      return Vec3(X_WI * Vec3(centre.a, centre.b, 0) + Vec3(1 - std::cos(t), 0, std::sin(t)) / bend);
    };
    NeedleState needle;
    needle.present = true;
    needle.X_WN.p = arc(0);
    needle.shape.is_bent = true;
    for (std::size_t i = 0; i < NeedleShape::kPoints; ++i)
      needle.shape.points[i] = arc(12.5 * static_cast<double>(NeedleShape::kPoints - 1 - i));
    ASSERT_EQ(test::render(imager, field, {&needle, 1}), ImageResult::kNew);
    const PlanePoint surface{centre.a - 0.635 * beam.a, centre.b - 0.635 * beam.b};
    EXPECT_LE(apart(spot_near(imager, surface, 1.5), surface), 0.2) << k;
  }
}

TEST(UltrasoundImage, DrawsTheTipOfANeedleThatEndsInTheTransversePlane) {
  UltrasoundImager::Options options = bright("transverse");
  options.settings.elevation_mm = 0.5;  // of the shaft behind the tip little is in the slice
  UltrasoundImager imager(options, std::make_shared<EchoMap>());
  FunctionField field(kNoMotion);
  const RigidTransform X_WI = test::probe_below() * imager.plane().in_probe();
  for (int k = 0; k < 10; ++k) {
    const PlanePoint tip{-14 + 3.0 * k, 28 + 1.5 * k};
    NeedleState needle;
    needle.present = true;
    needle.X_WN.p = X_WI * Vec3(tip.a, tip.b, 0);
    ASSERT_EQ(test::render(imager, field, {&needle, 1}), ImageResult::kNew);
    EXPECT_LE(apart(spot_near(imager, tip, 1), tip), 0.2) << k;
  }
}

Scene small_scene() {
  Scene scene;
  scene.tissue.points = 2500;
  return scene;
}

// A gland with a needle in it that has dragged it along and pushed it aside.
struct DeepNeedle {
  explicit DeepNeedle(const Scene& scene)
      : simulator(load_simulation_model(scene, load_tissue(scene).tissue)), state(simulator.initial_state()) {
    for (const RigidTransform& X_WN : test::insertion()) {
      if (X_WN.p.x() > 9.2) break;
      simulator.step(needle_pose(X_WN), state);
    }
    for (int k = 0; k < 50 && state.summary.certificate.verdict != Verdict::kInjective; ++k)
      simulator.step(NeedlePose(state.needles.states[0].input), state);
  }
  ImagedState imaged(const RigidTransform& X_WP) {
    return {simulator.field(),
            simulator.body_frame(),
            state.summary.certificate.verdict,
            state.summary.tick,
            state.needles.states,
            state.seeds.in_tissue(),
            X_WP};
  }
  Vec3 displacement_at(const Vec3& X) { return simulator.field().displacement_at(X); }

  Simulator simulator;
  MeshState state;
};

TEST(UltrasoundImage, TissueThatMovesOnIsFoundAtOnce) {
  double amplitude_mm = 0;
  FunctionField field(
      [&](const Vec3& X) { return Vec3(amplitude_mm * std::sin(0.06 * X.z()), 0, amplitude_mm); });
  const ImagePlane plane(plain_options("transverse").settings, 10);
  InverseField inverse(plane);
  const RigidTransform X_WI = test::probe_below() * plane.in_probe();
  std::vector<double> evaluations;  // of a node
  for (int k = 1; k <= 4; ++k) {
    amplitude_mm = 0.1 * k;
    ASSERT_TRUE(inverse.solve(field, BodyFrame(), X_WI));
    evaluations.push_back(static_cast<double>(inverse.evaluations()) /
                          static_cast<double>(inverse.node_count()));
  }
  EXPECT_GT(evaluations[1], 2);  // it had been still
  EXPECT_LT(evaluations[3], 1.3);
}

TEST(UltrasoundImage, FindsTheMaterialPointsOfADeformedGland) {
  const Scene scene = small_scene();
  DeepNeedle deep(scene);
  ASSERT_EQ(deep.state.summary.certificate.verdict, Verdict::kInjective);
  ASSERT_GT(deep.state.summary.max_displacement_mm, 1);
  const RigidTransform X_WP = resting_probe(scene, deep.simulator.tissue());
  for (const char* array : {"transverse", "sagittal"}) {
    Scene of_array = scene;
    of_array.ultrasound.array = array;
    const ImagePlane plane(of_array.ultrasound, 10);
    const RigidTransform X_WI = X_WP * plane.in_probe();
    InverseField inverse(plane);
    for (const bool is_warm : {false, true}) {
      ASSERT_TRUE(inverse.solve(deep.simulator.field(), deep.simulator.body_frame(), X_WI)) << array;
      EXPECT_LE(inverse.worst_residual_mm(), 0.02);
      if (is_warm) {  // once each, and every second of each row and column once across the plane
        EXPECT_GT(inverse.evaluations(), inverse.node_count());
        EXPECT_LT(static_cast<double>(inverse.evaluations()),
                  1.3 * static_cast<double>(inverse.node_count()));
      }
    }
    double squares = 0, n = 0;
    for (double line = 40; line < 480; line += 20)
      for (double depth = 5; depth < 55; depth += 3) {
        const PlanePoint p = plane.at(line, depth);
        const Vec3 y = X_WI * Vec3(p.a, p.b, 0), X = inverse.at(p).X;
        squares += (X + deep.displacement_at(X) - y).squaredNorm();
        n += 1;
      }
    EXPECT_LE(std::sqrt(squares / n), 0.02) << array;
  }
}

TEST(UltrasoundImage, PatchesOfThePlaneAreWhatSinglePlacesAre) {
  DeepNeedle deep(small_scene());
  const Scene scene = small_scene();
  const RigidTransform X_WP = resting_probe(scene, deep.simulator.tissue());
  const ImagePlane plane(scene.ultrasound, 10);
  InverseField inverse(plane);
  ASSERT_TRUE(inverse.solve(deep.simulator.field(), deep.simulator.body_frame(), X_WP * plane.in_probe()));
  double moved = 0;
  for (const auto& [column, row] : {std::pair<std::size_t, std::size_t>{54, 20}, {60, 34}, {42, 48}}) {
    InverseField::Patch patch;
    inverse.find(column, row, patch);
    for (std::size_t j = 0; j < InverseField::Patch::kSide; ++j)
      for (std::size_t i = 0; i < InverseField::Patch::kSide; ++i) {
        const double half = 0.5 * InverseField::kSpacingMm;
        const PlanePoint p{inverse.left_mm() + half * static_cast<double>(column + i),
                           inverse.bottom_mm() + half * static_cast<double>(row + j)};
        const InverseField::Sample sample = inverse.at(p);
        for (std::size_t d = 0; d < 3; ++d) {
          EXPECT_NEAR(patch.X[d][j][i], sample.X[static_cast<Eigen::Index>(d)], 2e-5);
          EXPECT_NEAR(patch.by_n[d][j][i], sample.X_by_n[static_cast<Eigen::Index>(d)], 2e-6);
        }
        const Vec3 y = X_WP * plane.in_probe() * Vec3(p.a, p.b, 0);
        moved = std::max(moved, (sample.X - y).norm());
      }
  }
  EXPECT_GT(moved, 0.3);
}

TEST(UltrasoundImage, FieldEvaluatesManyPointsAsItDoesOne) {
  DeepNeedle deep(small_scene());
  std::vector<Vec3> X;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> in(-1, 1);
  for (int k = 0; k < 150; ++k) {
    const double x = 20 * in(random), y = 15 * in(random);
    X.emplace_back(x, y, 18 * in(random));
  }
  std::vector<Vec3> u(X.size());
  deep.simulator.field().displacements_at(X, u);
  double worst = 0;
  for (std::size_t k = 0; k < X.size(); ++k)
    worst = std::max(worst, (u[k] - deep.displacement_at(X[k])).norm());
  EXPECT_LE(worst, 0.02);  // far landmarks are taken together
}

TEST(UltrasoundImage, DrawsTheCapsuleWhereTheFieldPutsIt) {
  Scene scene = small_scene();
  scene.ultrasound.surroundings = false;
  scene.ultrasound.noise_db = -150;
  scene.ultrasound.dynamic_range_db = 120;
  DeepNeedle deep(scene);
  const RigidTransform X_WP = resting_probe(scene, deep.simulator.tissue());
  UltrasoundImager imager(imager_options(scene), load_echo_map(scene, load_structures(scene)));
  ImagedState state = deep.imaged(X_WP);
  state.needles = {};  // its echo and shadow would lie over the capsule
  ASSERT_EQ(imager.render(state), ImageResult::kNew);
  const ImagePlane& plane = imager.plane();
  const RigidTransform X_WI = X_WP * plane.in_probe();
  const SurfaceBvh& surface = deep.simulator.model()->surface;
  const auto is_inside = [&](double line, double depth) {
    const PlanePoint p = plane.at(line, depth);
    const Vec3 y = X_WI * Vec3(p.a, p.b, 0);
    Vec3 X = y;
    for (int k = 0; k < 40; ++k) X = y - deep.displacement_at(X);
    return surface.inside(X);
  };
  double bias = 0, n = 0;
  for (std::size_t line = 180; line < 332; line += 2) {
    const auto l = static_cast<double>(line);
    double lower = 25, upper = 55;
    if (!is_inside(l, lower) || is_inside(l, upper)) continue;
    while (upper - lower > 0.01) {
      const double middle = 0.5 * (lower + upper);
      (is_inside(l, middle) ? lower : upper) = middle;
    }
    double sum = 0, at = 0;
    const auto reach = static_cast<int>(std::lround(0.5 / imager.sample_mm()));
    const auto s0 = static_cast<int>(lower / imager.sample_mm());
    for (int s = s0 - reach; s <= s0 + reach + 1; ++s) {
      const double w = std::pow(pressure_at(imager, line, static_cast<std::size_t>(s)), 2);
      sum += w;
      at += w * s;
    }
    bias += at / sum * imager.sample_mm() - lower;
    n += 1;
  }
  ASSERT_GT(n, 40);
  EXPECT_LE(std::abs(bias / n), 0.2);
}

TEST(UltrasoundImage, IsTheSameForAnyNumberOfThreads) {
  const Scene scene = small_scene();
  DeepNeedle deep(scene);
  const RigidTransform X_WP = resting_probe(scene, deep.simulator.tissue());
  const auto echoes = load_echo_map(scene, load_structures(scene));
  std::vector<std::uint8_t> first;
  for (const int threads : {1, 2, 3}) {
    UltrasoundImager::Options options = imager_options(scene);
    options.threads = threads;
    UltrasoundImager imager(options, echoes);
    for (int again = 0; again < 2; ++again) {
      ASSERT_EQ(imager.render(deep.imaged(X_WP)), ImageResult::kNew);
      const std::vector<std::uint8_t> pixels(imager.pixels().begin(), imager.pixels().end());
      if (first.empty()) first = pixels;
      EXPECT_TRUE(pixels == first) << threads << " threads";
    }
  }
  EXPECT_GT(*std::ranges::max_element(first), 200);
}

TEST(UltrasoundImage, DoesNotAllocate) {
  if (!test::allocations_are_counted()) GTEST_SKIP() << "the sanitizer owns malloc";
  const Scene scene = small_scene();
  DeepNeedle deep(scene);
  const RigidTransform X_WP = resting_probe(scene, deep.simulator.tissue());
  for (const char* array : {"transverse", "sagittal"}) {
    Scene of_array = scene;
    of_array.ultrasound.array = array;
    UltrasoundImager imager(imager_options(of_array), load_echo_map(scene, load_structures(scene)));
    const std::uint64_t before = test::allocation_count();
    for (int k = 0; k < 3; ++k) imager.render(deep.imaged(X_WP));
    EXPECT_EQ(test::allocation_count() - before, 0u);
  }
}

TEST(UltrasoundImage, StandsWhereTheFieldFoldsAndGoesOnWhereThatIsUnknown) {
  UltrasoundImager imager(plain_options("transverse"), std::make_shared<EchoMap>());
  FunctionField rest(kNoMotion);
  FunctionField moved([](const Vec3&) { return Vec3(0, 1, 0); });
  ASSERT_EQ(test::render(imager, rest), ImageResult::kNew);
  const std::vector<std::uint8_t> last(imager.pixels().begin(), imager.pixels().end());
  const BodyFrame frame;
  EXPECT_EQ(imager.render({moved, frame, Verdict::kFolded, 2, {}, {}, test::probe_below()}),
            ImageResult::kFolded);
  EXPECT_TRUE(std::ranges::equal(last, imager.pixels()));
  EXPECT_EQ(imager.render({moved, frame, Verdict::kUnknown, 2, {}, {}, test::probe_below()}),
            ImageResult::kNew);
  EXPECT_FALSE(std::ranges::equal(last, imager.pixels()));
}

TEST(UltrasoundImage, PlacesItsPixelsInTheWorld) {
  UltrasoundSettings settings;
  for (const char* array : {"transverse", "sagittal", "end_fire"}) {
    settings.array = array;
    const ImagePlane plane(settings, 10);
    EXPECT_LE(rigidity_error(plane.in_probe()), 1e-12);
    for (const double line : {0.0, 100.5, 511.0}) {
      const PlanePoint p = plane.at(line, 21);
      EXPECT_NEAR(plane.find(p).line, line, 1e-9);
      EXPECT_NEAR(plane.find(p).depth, 21, 1e-9);
      const Vec3 in_image(plane.column_of(p.a) * plane.spacing_mm(), plane.row_of(p.b) * plane.spacing_mm(),
                          0);
      EXPECT_LE((plane.image_in_plane() * in_image - Vec3(p.a, p.b, 0)).norm(), 1e-9);
    }
  }
  settings.array = "round";
  EXPECT_THROW(ImagePlane(settings, 10), UserError);
}

}  // namespace
}  // namespace brachy
