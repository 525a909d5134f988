// Where the image shows a tip, a seed, the capsule and the urethra, against where the simulation has them, over random
// states of the tissue with certified fields. scripts/campaigns/ultrasound_truth.sh runs it over a thousand.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <random>

#include "core/geometry/surface/plane_section.h"
#include "core/geometry/surface/surface_bvh.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/core/ultrasound/ultrasound_testing.h"

namespace brachy {
namespace {

constexpr double kGoalMm = 0.2;

/// Tissue without noise and made-up surroundings, in which the places of structures alone decide: nor does what lies
/// before them, as it takes nothing (urine takes less than tissue).
Scene truth_scene() {
  Scene scene;
  scene.tissue.points = 2500;
  scene.ultrasound.surroundings = false;
  scene.ultrasound.noise_db = -150;
  scene.ultrasound.attenuation_db_per_cm_mhz = 0;
  scene.ultrasound.dynamic_range_db = 120;
  return scene;
}

UltrasoundImager::Options metal_options(const Scene& scene) {
  UltrasoundImager::Options options = imager_options(scene);
  options.settings.needle_echo_db = options.settings.seed_echo_db = 45;  // far above speckle
  options.settings.shadow_db = 0;
  options.settings.elevation_mm = 0.5;  // of the shaft behind a tip little is in the slice
  return options;
}

std::vector<Structure> without_urethra(std::vector<Structure> structures) {
  std::erase_if(structures, [](const Structure& s) { return s.name == "urethra"; });
  return structures;
}

/// A needle goes into the gland again and again, each time elsewhere; every 1.2 mm of its way is a state.
class RandomStates {
 public:
  explicit RandomStates(std::uint32_t seed) : random_(seed) {}

  std::map<std::string, std::vector<double>> errors_mm;  ///< of what is drawn, by what it is

  void measure() {
    do advance();
    while (state_.summary.certificate.verdict != Verdict::kInjective ||
           state_.needles.states[0].contact != ContactState::kInserted);
    RigidTransform X_WP = X_WR_;
    X_WP.p.z() += 8 * in_(random_);
    measure_capsule(X_WP);
    measure_urethra(X_WP);
    measure_tip();
    measure_seed();
  }

 private:
  void step() {
    RigidTransform X_WN;
    X_WN.p = tip_;
    simulator_.step(test::needle_pose(X_WN), state_);
  }
  void advance() {
    if (tip_.z() > end_z_) {
      for (; tip_.z() > -35; tip_.z() -= 0.5) step();
      const double x = 11 * in_(random_), y = 9 * in_(random_);
      tip_ = {x, y, -35};
      end_z_ = 8 + 6 * in_(random_);
    }
    for (int k = 0; k < 8; ++k, tip_.z() += 0.15) step();
  }
  Vec3 material_point(const Vec3& y) {
    Vec3 X = y;
    for (int k = 0; k < 25; ++k) X = y - simulator_.field().displacement_at(X);
    return X;
  }
  bool draw(UltrasoundImager& imager, const RigidTransform& X_WP, std::span<const NeedleState> needles = {},
            std::span<const Seed> seeds = {}) {
    return imager.render({simulator_.field(), simulator_.body_frame(), Verdict::kInjective,
                          state_.summary.tick, needles, seeds, X_WP}) == ImageResult::kNew;
  }

  /// The far capsule's echo: its power's centroid on each line, on average over the lines, as speckle interferes.
  void measure_capsule(const RigidTransform& X_WP) {
    ASSERT_TRUE(draw(tissue_, X_WP));
    const ImagePlane& plane = tissue_.plane();
    const RigidTransform X_WI = X_WP * plane.in_probe();
    const auto is_inside = [&](double line, double depth) {
      const PlanePoint p = plane.at(line, depth);
      return gland_.inside(material_point(X_WI * Vec3(p.a, p.b, 0)));
    };
    double bias = 0, n = 0;
    for (std::size_t line = 180; line < 332; line += 2) {
      const auto l = static_cast<double>(line);
      double lower = 25, upper = 55;
      if (!is_inside(l, lower) || is_inside(l, upper)) continue;
      while (upper - lower > 0.02) {
        const double middle = 0.5 * (lower + upper);
        (is_inside(l, middle) ? lower : upper) = middle;
      }
      double sum = 0, at = 0;
      const auto reach = static_cast<int>(std::lround(0.5 / tissue_.sample_mm()));
      const auto s0 = static_cast<int>(lower / tissue_.sample_mm());
      for (int s = s0 - reach; s <= s0 + reach + 1; ++s) {
        const double w = std::pow(test::pressure_at(tissue_, line, static_cast<std::size_t>(s)), 2);
        sum += w;
        at += w * s;
      }
      bias += at / sum * tissue_.sample_mm() - lower;
      n += 1;
    }
    if (n > 40) errors_mm["capsule"].push_back(std::abs(bias / n));
  }

  /// The urethra is darker: where the image of the same speckle without it is brighter by more than 4 dB, that gain's
  /// centroid, against the centroid of its cross-section.
  void measure_urethra(const RigidTransform& X_WP) {
    ASSERT_TRUE(draw(filled_, X_WP));
    const ImagePlane& plane = tissue_.plane();
    const RigidTransform X_WI = X_WP * plane.in_probe();
    Vec2 seen = Vec2::Zero(), is = Vec2::Zero();
    double dark = 0, area = 0;
    const auto samples_in = [&](double mm) {
      return static_cast<std::size_t>(std::lround(mm / tissue_.sample_mm()));
    };
    const std::size_t from = samples_in(2.4), to = samples_in(25.6), step = samples_in(0.16);
    for (std::size_t line = 0; line < plane.lines(); line += 2)
      for (std::size_t s = from; s < to; s += step) {
        const auto l = static_cast<double>(line);
        const double depth = tissue_.sample_mm() * static_cast<double>(s);
        const double gain = 20 * std::log10(test::pressure_at(filled_, line, s) /
                                            std::max(1e-6, test::pressure_at(tissue_, line, s)));
        const PlanePoint p = plane.at(l, depth);
        const double weight = plane.line_spacing_mm(depth);  // of the sample's area
        if (gain > 4) {
          seen += weight * std::min(gain, 10.0) * Vec2(p.a, p.b);
          dark += weight * std::min(gain, 10.0);
        }
        if (tissue_.inverse().at(p).X.head<2>().norm() > 12) continue;  // the urethra is about the axis
        if (!urethra_.inside(material_point(X_WI * Vec3(p.a, p.b, 0)))) continue;
        is += weight * Vec2(p.a, p.b);
        area += weight;
      }
    if (area > 0 && dark > 0) errors_mm["urethra"].push_back((seen / dark - is / area).norm());
  }

  void measure_tip() {
    const NeedleState& needle = state_.needles.states[0];
    const RigidTransform X_WP = across(needle.X_WN.p.z());
    ASSERT_TRUE(draw(metal_, X_WP, {&needle, 1}));
    add_spot("tip", X_WP, needle.X_WN.p, 0, 1);
  }

  /// A seed that lies at a random place of the gland, which the field has moved.
  void measure_seed() {
    const double x = 12 * in_(random_), y = 9 * in_(random_), z = 12 * in_(random_);
    const Vec3 X(x, y, z);
    Seed seed;
    seed.position = simulator_.body_frame().to_world(X + simulator_.field().displacement_at(X));
    const RigidTransform X_WP = across(seed.position.z());
    ASSERT_TRUE(draw(metal_, X_WP, {}, {&seed, 1}));
    add_spot("seed", X_WP, seed.position, 0.4, 1.5);
  }

  /// The probe so far in that its transverse plane is at z.
  RigidTransform across(double z) const {
    RigidTransform X_WP = X_WR_;
    const RigidTransform X_WI = X_WR_ * metal_.plane().in_probe();
    X_WP.p.z() += z - X_WI.p.z();
    return X_WP;
  }
  void add_spot(const char* what, const RigidTransform& X_WP, const Vec3& p_W, double radius_mm,
                double reach_mm) {
    const ImagePlane& plane = metal_.plane();
    const Vec3 p_I = (X_WP * plane.in_probe()).inverse() * p_W;
    PlanePoint p{p_I.x(), p_I.y()};
    const LinePoint at = plane.find(p);
    if (at.depth < 8 || at.depth > 52 || !plane.is_in_scan(at)) return;
    const PlanePoint beam = plane.beam(at.line);
    p = {p.a - radius_mm * beam.a, p.b - radius_mm * beam.b};  // the side that faces the probe
    errors_mm[what].push_back(test::apart(test::spot_near(metal_, p, reach_mm), p));
  }

  std::mt19937 random_;
  std::uniform_real_distribution<double> in_{-1, 1};
  const Scene scene_ = truth_scene();
  const std::vector<Structure> structures_ = load_structures(scene_);
  Simulator simulator_{load_simulation_model(scene_, load_tissue(scene_).tissue)};
  MeshState state_ = simulator_.initial_state();
  const SurfaceBvh gland_{structures_.front().mesh}, urethra_{find_structure(structures_, "urethra")->mesh};
  const RigidTransform X_WR_ = resting_probe(scene_, simulator_.tissue());
  const std::shared_ptr<const EchoMap> echoes_ = load_echo_map(scene_, structures_);
  UltrasoundImager tissue_{imager_options(scene_), echoes_};
  UltrasoundImager filled_{imager_options(scene_), load_echo_map(scene_, without_urethra(structures_))};
  UltrasoundImager metal_{metal_options(scene_), echoes_};
  Vec3 tip_{0, 0, -30};
  double end_z_ = 10;
};

TEST(UltrasoundTruth, EverythingIsDrawnWithinATenthOrTwoOfWhereTheSimulationHasIt) {
  const char* wanted = std::getenv("BRACHY_TRUTH_STATES");
  const int count = wanted ? std::atoi(wanted) : 6;
  RandomStates states(11);
  for (int k = 0; k < count; ++k) {
    states.measure();
    if (HasFatalFailure()) return;
  }
  if (wanted) std::printf("%-10s%8s%8s%8s%8s\n", "mm", "states", "p50", "p95", "max");
  for (auto& [what, errors] : states.errors_mm) {
    std::ranges::sort(errors);
    const auto at = [&errors = errors](double share) {
      return errors[static_cast<std::size_t>(share * static_cast<double>(errors.size() - 1))];
    };
    if (wanted)
      std::printf("%-10s%8zu%8.3f%8.3f%8.3f\n", what.c_str(), errors.size(), at(0.5), at(0.95), at(1));
    EXPECT_LE(errors.back(), kGoalMm) << what;
  }
  EXPECT_EQ(states.errors_mm.size(), 4u);
}

}  // namespace
}  // namespace brachy
