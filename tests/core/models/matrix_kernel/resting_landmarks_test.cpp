// What a tick keeps of landmarks that rest, whichever numbers they have, does not change what it shows.
#include <gtest/gtest.h>

#include <array>

#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "tests/core/models/blocks/small_tissue.h"

namespace brachy {
namespace {

constexpr std::size_t kPerNeedle = 7;

/// Needles of seven landmarks, 6 mm apart, by number: 0 rests at its place, and so on; each `raised` by so many mm.
struct NeedleLandmarks {
  std::vector<Vec3> positions, displacements;
  std::vector<LandmarkSpread> spreads;

  void add(std::size_t needle, double raised, std::size_t count = kPerNeedle) {
    for (std::size_t i = 0; i < count; ++i) {
      const bool is_tip = i + 1 == count;
      positions.emplace_back(6 * static_cast<double>(needle % 3) - 6, 6 * static_cast<double>(needle / 3) - 6,
                             raised + 4 * static_cast<double>(i) - 12);
      displacements.emplace_back(0.1 * static_cast<double>(needle), 0.2, 0.3);
      spreads.push_back({.core_mm = is_tip ? 8.0 : 0.0,
                         .behind = is_tip ? static_cast<std::int32_t>(positions.size()) - 2 : -1});
    }
  }
};

// Forces, the landmarks' stiffness along z, and that of the first needle.
struct Solved {
  std::vector<Vec3> forces;
  Eigen::MatrixXd H;
  double stiffness = 0;
};

Solved solve(MatrixKernelField& field, const NeedleLandmarks& landmarks) {
  Solved solved;
  EXPECT_TRUE(field.update(LandmarkSet::of(landmarks.positions, landmarks.displacements, landmarks.spreads)));
  const std::size_t n = landmarks.positions.size();
  solved.forces.assign(field.forces().begin(), field.forces().end());
  solved.H.resize(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  field.axial_stiffness(0, std::vector<Vec3>(n, Vec3::UnitZ()), solved.H);
  std::vector<std::uint32_t> group_of(n, TissueField::kNoGroup);
  std::fill_n(group_of.begin(), kPerNeedle, 0u);
  field.rigid_stiffness(group_of, std::vector<Vec3>(n, Vec3::UnitX()), {&solved.stiffness, 1});
  return solved;
}

TEST(RestingLandmarks, HaveTheSameBitsWhateverWasThereBefore) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  const MatrixKernelField::Options options{.max_landmarks = 80};
  MatrixKernelField kept(tissue, "elastic", {}, options);
  std::vector<NeedleLandmarks> ticks(7);
  for (std::size_t n = 0; n < 9; ++n) ticks[0].add(n, 0);  // nine needles …
  for (std::size_t n = 0; n < 8; ++n) ticks[1].add(n, 0);  // … of which the last goes on
  ticks[1].add(8, 0.3);
  ticks[2].add(0, 0);  // one gets a landmark less …
  ticks[2].add(1, 0.2, kPerNeedle - 1);
  for (std::size_t n = 2; n < 9; ++n) ticks[2].add(n, 0);
  for (std::size_t n = 0; n < 9; ++n)
    ticks[3].add(n == 0 ? 3 : n == 3 ? 0 : n, 0);            // … and two change places
  for (std::size_t n = 0; n < 3; ++n) ticks[4].add(n, 0.1);  // few are left …
  for (std::size_t n = 0; n < 9; ++n) ticks[5].add(n, 0);    // … and all are back
  for (std::size_t n = 0; n < 9; ++n) ticks[6].add(n, n < 4 ? 0.5 : 0);
  for (std::size_t t = 0; t < ticks.size(); ++t) {
    MatrixKernelField fresh(tissue, "elastic", {}, options);
    const Solved a = solve(kept, ticks[t]), b = solve(fresh, ticks[t]);
    EXPECT_EQ(a.forces, b.forces) << t;
    EXPECT_EQ(a.H, b.H) << t;
    EXPECT_EQ(a.stiffness, b.stiffness) << t;
  }
}

TEST(RestingLandmarks, AreAsStiffTogetherAsTheirForcesSay) {
  const Tissue tissue = test::small_phantom(Vec3::Zero());
  MatrixKernelField field(tissue, "elastic", {}, {.max_landmarks = 80});
  for (const std::size_t needles : {2u, 9u}) {  // by both factors
    NeedleLandmarks landmarks;
    for (std::size_t n = 0; n < needles; ++n) landmarks.add(n, 0);
    const double stiffness = solve(field, landmarks).stiffness;
    std::vector<Vec3> unit(landmarks.positions.size(), Vec3::Zero()), forces = unit;
    std::fill_n(unit.begin(), kPerNeedle, Vec3(Vec3::UnitX()));
    field.solve(unit, forces);
    double sum = 0;
    for (std::size_t i = 0; i < kPerNeedle; ++i) sum += forces[i].x();
    EXPECT_NEAR(stiffness, sum, 1e-9 * sum) << needles;
  }
}

}  // namespace
}  // namespace brachy
