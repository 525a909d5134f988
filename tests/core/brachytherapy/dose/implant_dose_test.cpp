#include "core/brachytherapy/dose/implant_dose.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "core/base/error.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/geometry/tissue/phantom.h"

namespace brachy {
namespace {

// A box with its faces along the axes, outward.
SurfaceMesh box(const Vec3& min, const Vec3& max) {
  SurfaceMesh mesh;
  for (unsigned corner = 0; corner < 8; ++corner)
    mesh.vertices.emplace_back(corner & 1 ? max.x() : min.x(), corner & 2 ? max.y() : min.y(),
                               corner & 4 ? max.z() : min.z());
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

// A closed tube along z about (x, y).
SurfaceMesh cylinder(double x, double y, double radius, double from, double to) {
  constexpr std::uint32_t kSides = 64;
  SurfaceMesh mesh;
  mesh.vertices = {{x, y, from}, {x, y, to}};
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const double a = 2 * std::numbers::pi * i / kSides;
    mesh.vertices.emplace_back(x + radius * std::cos(a), y + radius * std::sin(a), from);
    mesh.vertices.emplace_back(x + radius * std::cos(a), y + radius * std::sin(a), to);
  }
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % kSides);
    mesh.triangles.insert(mesh.triangles.end(),
                          {{0, b, a}, {1, a + 1, b + 1}, {a, b, a + 1}, {b, b + 1, a + 1}});
  }
  return mesh;
}

std::vector<Vec3> random_points_in(const SurfaceMesh& mesh, std::size_t count, std::mt19937& random) {
  const SurfaceBvh surface(mesh);
  std::vector<Vec3> points;
  std::uniform_real_distribution<double> one(0, 1);
  while (points.size() < count) {
    const double x = one(random), y = one(random), z = one(random);
    const Vec3 p = surface.min() + Vec3(x, y, z).cwiseProduct(surface.max() - surface.min());
    if (surface.inside(p)) points.push_back(p);
  }
  return points;
}

// 100 seeds at random in the phantom's gland, at least 4 mm apart and 3 mm below its surface; 0.4 U, about along z.
std::vector<DoseSeed> implant(std::mt19937& random) {
  const SurfaceBvh gland(prostate_phantom());
  std::vector<DoseSeed> seeds;
  while (seeds.size() < 100) {
    const Vec3 p = random_points_in(gland.mesh(), 1, random).front();
    if (gland.closest_point(p).signed_distance > -3) continue;
    if (std::any_of(seeds.begin(), seeds.end(),
                    [&](const DoseSeed& s) { return (s.position - p).norm() < 4; }))
      continue;
    std::uniform_real_distribution<double> tilt(-0.1, 0.1);
    const double x = tilt(random), y = tilt(random);
    seeds.push_back({.position = p, .axis = Vec3(x, y, 1).normalized(), .air_kerma_strength_u = 0.4});
  }
  return seeds;
}

double share_of(const std::vector<double>& doses, double gy) {
  const auto count = std::count_if(doses.begin(), doses.end(), [&](double d) { return d >= gy; });
  return static_cast<double>(count) / static_cast<double>(doses.size());
}

// The minimum dose to the hottest `share` of the points.
double dose_of(std::vector<double> doses, double share) {
  const auto n = static_cast<std::ptrdiff_t>(share * static_cast<double>(doses.size()));
  std::nth_element(doses.begin(), doses.begin() + n, doses.end(), std::greater<>());
  return doses[static_cast<std::size_t>(n)];
}

TEST(StructureVoxels, AreWholeOnesAndTheirPartsOfABox) {
  const DoseGrid grid(Vec3::Constant(-20), Vec3::Constant(20), 1);
  // Voxels' faces are at halves: in x the box ends three quarters into a voxel, in y on faces, in z at centres.
  const StructureVoxels voxels =
      structure_voxels(SurfaceBvh(box({-13.25, -14.5, -14}, {13.25, 14.5, 14})), grid);
  EXPECT_NEAR(voxels.volume_cc, 26.5 * 29 * 28 / 1000, 1e-6);
  EXPECT_EQ(voxels.whole.size(), 25u * 29 * 27);
  EXPECT_EQ(voxels.parts.size(), 27u * 29 * 29 - 25u * 29 * 27);
  EXPECT_TRUE(std::is_sorted(voxels.whole.begin(), voxels.whole.end()));
  EXPECT_TRUE(std::binary_search(voxels.whole.begin(), voxels.whole.end(), grid.index(20, 20, 20)));
  // The part in the voxel about p.
  const auto part = [&](const Vec3& p) -> const StructureVoxels::Part* {
    const auto at = std::find_if(
        voxels.parts.begin(), voxels.parts.end(),
        [&](const StructureVoxels::Part& each) { return (each.centre - p).cwiseAbs().maxCoeff() < 0.5; });
    return at == voxels.parts.end() ? nullptr : &*at;
  };
  ASSERT_TRUE(part({-13, 0, 0}) && part({0, 0, -14}) && part({13, 0, 14}));
  EXPECT_NEAR(part({-13, 0, 0})->volume_mm3, 0.75, 1e-6);
  EXPECT_NEAR((part({-13, 0, 0})->centre - Vec3(-12.875, 0, 0)).norm(), 0, 1e-6);
  EXPECT_NEAR(part({0, 0, -14})->volume_mm3, 0.5, 1e-6);
  EXPECT_NEAR((part({0, 0, -14})->centre - Vec3(0, 0, -13.75)).norm(), 0, 1e-6);
  EXPECT_NEAR(part({13, 0, 14})->volume_mm3, 0.375, 1e-6);
  EXPECT_FALSE(part({0, 0, 0}) || part({-14, 0, 0}) || part({0, 15, 0}));
}

TEST(StructureVoxels, AreCutIntoPiecesWhereTheyAreFew) {
  const DoseGrid grid(Vec3::Constant(-20), Vec3::Constant(20), 2);
  const StructureVoxels voxels = structure_voxels(SurfaceBvh(box({-3, 1, 2}, {3, 9, 14})), grid);
  EXPECT_TRUE(voxels.whole.empty());
  EXPECT_GT(voxels.parts.size(), 20'000u);
  EXPECT_LT(voxels.parts.size(), 80'000u);
  EXPECT_NEAR(voxels.volume_cc, 6.0 * 8 * 12 / 1000, 1e-6);
  double volume = 0;
  Vec3 moment = Vec3::Zero();
  for (const StructureVoxels::Part& part : voxels.parts) {
    volume += part.volume_mm3;
    moment += part.volume_mm3 * part.centre;
  }
  EXPECT_NEAR(volume, 6.0 * 8 * 12, 1e-3);
  EXPECT_NEAR((moment / volume - Vec3(0, 5, 8)).norm(), 0, 1e-4);
}

TEST(StructureVoxels, HaveTheVolumeOfAThinTubeAtAnySpacing) {
  const double sides = 64 * 0.5 * std::sin(2 * std::numbers::pi / 64);  // of a polygon of unit radius
  for (const double spacing : {0.5, 1.0, 1.7, 3.0, 5.0}) {
    const DoseGrid grid(Vec3::Constant(-20), Vec3::Constant(20), spacing);
    const StructureVoxels voxels = structure_voxels(SurfaceBvh(cylinder(0.3, -0.2, 3, -15, 15)), grid);
    EXPECT_NEAR(voxels.volume_cc / (sides * 9 * 30 / 1000), 1, 0.01) << spacing;
  }
}

TEST(StructureVoxels, AreThoseWithinTheGridOnly) {
  const DoseGrid grid(Vec3::Zero(), Vec3::Constant(9), 1);  // voxels fill −0.5 … 9.5
  EXPECT_NEAR(structure_voxels(SurfaceBvh(box(Vec3::Constant(-20), Vec3::Constant(20))), grid).volume_cc, 1,
              1e-6);
  EXPECT_NEAR(structure_voxels(SurfaceBvh(box({-20, -20, 5.5}, {20, 20, 20})), grid).volume_cc, 0.4, 1e-6);
  const StructureVoxels none = structure_voxels(SurfaceBvh(box({20, 20, 20}, {30, 30, 30})), grid);
  EXPECT_TRUE(none.whole.empty() && none.parts.empty());
  EXPECT_EQ(none.volume_cc, 0);
}

TEST(StructureVoxels, LeaveOutTheHollowOfAShell) {
  SurfaceMesh shell = box(Vec3::Constant(-8), Vec3::Constant(8));
  const SurfaceMesh hollow = box(Vec3::Constant(-4), Vec3::Constant(4));
  for (const Triangle& t : hollow.triangles) shell.triangles.push_back({t[0] + 8, t[2] + 8, t[1] + 8});
  shell.vertices.insert(shell.vertices.end(), hollow.vertices.begin(), hollow.vertices.end());
  const DoseGrid grid(Vec3::Constant(-10), Vec3::Constant(10), 1);
  EXPECT_NEAR(structure_voxels(SurfaceBvh(shell), grid).volume_cc, (16.0 * 16 * 16 - 8.0 * 8 * 8) / 1000,
              1e-6);
}

// The box consists of whole voxels of the grid, so that a sorted list of doses gives all figures exactly.
TEST(StructureDose, IsWhatASortedListOfItsVoxelsSays) {
  DoseGrid grid(Vec3::Constant(-17), Vec3::Constant(17), 1);
  for (const Vec3& p : {Vec3(3, 2, 1), Vec3(-5, 4, -6), Vec3(2, -7, 3), Vec3(-6, -6, 6), Vec3(20, 20, 20)})
    grid.add({.position = p, .axis = Vec3::UnitZ(), .air_kerma_strength_u = 1});
  const SurfaceBvh cube(box(Vec3::Constant(-14.5), Vec3::Constant(14.5)));
  std::vector<double> doses;
  for (std::size_t k = 3; k < 32; ++k)
    for (std::size_t j = 3; j < 32; ++j)
      for (std::size_t i = 3; i < 32; ++i)
        doses.push_back(static_cast<double>(grid.dose_gy()[grid.index(i, j, k)]));
  constexpr double kPrescription = 30, kVolumeCc = 29.0 * 29 * 29 / 1000;
  const StructureDose dose = structure_dose("cube", structure_voxels(cube, grid), grid, kPrescription);
  EXPECT_EQ(dose.name, "cube");
  EXPECT_NEAR(dose.volume_cc, kVolumeCc, 1e-6);
  double sum = 0;
  for (const double d : doses) sum += d;
  EXPECT_NEAR(dose.mean_gy, sum / static_cast<double>(doses.size()), 1e-3);
  EXPECT_EQ(dose.min_gy, *std::min_element(doses.begin(), doses.end()));
  EXPECT_EQ(dose.max_gy, *std::max_element(doses.begin(), doses.end()));
  EXPECT_NEAR(dose.v100_percent, 100 * share_of(doses, kPrescription), 0.01);
  EXPECT_NEAR(dose.v150_percent, 100 * share_of(doses, 1.5 * kPrescription), 0.01);
  EXPECT_NEAR(dose.v200_percent, 100 * share_of(doses, 2 * kPrescription), 0.01);
  EXPECT_NEAR(dose.v100_cc, kVolumeCc * share_of(doses, kPrescription), 1e-3);
  // Between the neighbours in the list, up to a bin of the histogram.
  constexpr double kBin = 0.001 * kPrescription, kOne = 0.001 / kVolumeCc;
  const auto expect = [&](double gy, double share) {
    EXPECT_LE(gy, dose_of(doses, share - 2 * kOne) + kBin) << share;
    EXPECT_GE(gy, dose_of(doses, share + 2 * kOne) - kBin) << share;
  };
  expect(dose.d90_gy, 0.9);
  expect(dose.d30_gy, 0.3);
  expect(dose.d10_gy, 0.1);
  expect(dose.d2cc_gy, 2 / kVolumeCc);
  ASSERT_EQ(dose.volume_share.size(), 301u);
  EXPECT_EQ(dose.volume_share[0], 1);
  EXPECT_TRUE(std::is_sorted(dose.volume_share.rbegin(), dose.volume_share.rend()));
  for (const std::size_t percent : {20, 100, 131, 300})
    EXPECT_NEAR(static_cast<double>(dose.volume_share[percent]),
                share_of(doses, 0.01 * static_cast<double>(percent) * kPrescription), 1e-4);
}

TEST(StructureDose, HasNoFiguresOfWhatIsNotThere) {
  DoseGrid grid(Vec3::Zero(), Vec3::Constant(9), 1);
  grid.add({.position = Vec3::Zero(), .axis = Vec3::UnitZ(), .air_kerma_strength_u = 1});
  const SurfaceBvh outside(box(Vec3::Constant(20), Vec3::Constant(30))),
      small(box(Vec3::Zero(), Vec3::Constant(9)));
  const StructureDose none = structure_dose("outside", structure_voxels(outside, grid), grid, 145);
  EXPECT_EQ(none.volume_cc, 0);
  EXPECT_EQ(none.v100_cc, 0);
  EXPECT_TRUE(std::isnan(none.d90_gy) && std::isnan(none.max_gy) && std::isnan(none.d2cc_gy));
  const StructureDose less_than_2cc = structure_dose("small", structure_voxels(small, grid), grid, 145);
  EXPECT_TRUE(std::isnan(less_than_2cc.d2cc_gy));
  EXPECT_GT(less_than_2cc.d90_gy, 0);
}

TEST(StructureDose, KnowsDosesBeyondItsHistogram) {
  DoseGrid grid(Vec3::Constant(-3), Vec3::Constant(3), 0.5);
  grid.add({.position = Vec3::Zero(), .axis = Vec3::UnitZ(), .air_kerma_strength_u = 100});
  const StructureVoxels voxels =
      structure_voxels(SurfaceBvh(box(Vec3::Constant(-2), Vec3::Constant(2))), grid);
  const StructureDose dose = structure_dose("hot", voxels, grid, 1);
  EXPECT_EQ(dose.v200_percent, 100);
  EXPECT_GE(dose.d90_gy, dose.min_gy);
  EXPECT_GT(dose.d10_gy, dose.d90_gy);
  EXPECT_LE(dose.d10_gy, dose.max_gy);
}

TEST(ImplantDose, LaysItsGridAboutTheProstateWithItsMargin) {
  const std::vector<Structure> structures = {{"rectum", box({-10, -60, -30}, {10, -40, 30})},
                                             {"prostate", box({-25, -20, -22}, {25, 20, 23})}};
  const ImplantDose dose(structures,
                         {.prescription_gy = 145, .spacing_mm = 1, .margin_mm = 10, .source = {}});
  EXPECT_EQ(dose.grid().origin(), Vec3(-35, -30, -32));
  EXPECT_EQ(dose.grid().size(), (std::array<std::size_t, 3>{71, 61, 66}));
  const ImplantDose first({structures[0]},
                          {.prescription_gy = 145, .spacing_mm = 2, .margin_mm = 0, .source = {}});
  EXPECT_EQ(first.grid().origin(), Vec3(-10, -60, -30));
  EXPECT_THROW(ImplantDose({}, {}), UserError);
}

TEST(ImplantDose, CountsSeedsAndForgetsThemOnClear) {
  ImplantDose dose({{"prostate", prostate_phantom()}},
                   {.prescription_gy = 145, .spacing_mm = 3, .margin_mm = 5, .source = {}});
  EXPECT_EQ(dose.seed_count(), 0u);
  EXPECT_EQ(dose.evaluate().at(0).max_gy, 0);
  EXPECT_EQ(dose.evaluate().at(0).v100_percent, 0);
  dose.add({.position = Vec3::Zero(), .axis = Vec3::UnitZ(), .air_kerma_strength_u = 0.5});
  EXPECT_EQ(dose.seed_count(), 1u);
  EXPECT_GT(dose.evaluate().at(0).d90_gy, 0);
  dose.clear();
  EXPECT_EQ(dose.seed_count(), 0u);
  EXPECT_EQ(dose.evaluate().at(0).max_gy, 0);
}

// The required accuracy: 100 seeds, 1 mm, against exact sums at 10⁵ random points (which have errors of about 0.1 %
// themselves). The urethra is a tube 6 mm wide.
TEST(ImplantDose, IsWithinOnePercentOfExactSumsAtRandomPoints) {
  std::mt19937 random(21);
  const std::vector<DoseSeed> seeds = implant(random);
  const std::vector<Structure> structures = {{"prostate", prostate_phantom()},
                                             {"urethra", cylinder(0, 5, 3, -18, 18)}};
  const DoseSettings settings{.prescription_gy = 145, .spacing_mm = 1, .margin_mm = 10, .source = {}};
  ImplantDose implant_dose(structures, settings);
  for (const DoseSeed& seed : seeds) implant_dose.add(seed);
  const std::vector<StructureDose> doses = implant_dose.evaluate();
  ASSERT_EQ(doses.size(), 2u);
  for (std::size_t s = 0; s < doses.size(); ++s) {
    SCOPED_TRACE(doses[s].name);
    EXPECT_EQ(doses[s].name, structures[s].name);
    std::vector<double> exact;
    for (const Vec3& p : random_points_in(structures[s].mesh, 100'000, random))
      exact.push_back(total_dose_gy(seeds, p));
    const double v100 = 100 * share_of(exact, 145), v150 = 100 * share_of(exact, 217.5);
    // The test is meaningful only where these are not 0 or 100 %.
    EXPECT_TRUE(s == 1 || (v100 > 50 && v100 < 99.5)) << v100;
    EXPECT_NEAR(doses[s].v100_percent / v100, 1, 0.01);
    EXPECT_NEAR(doses[s].v150_percent / v150, 1, 0.01);
    EXPECT_NEAR(doses[s].d90_gy / dose_of(exact, 0.9), 1, 0.01);
    EXPECT_NEAR(doses[s].d30_gy / dose_of(exact, 0.3), 1, 0.01);
    EXPECT_NEAR(doses[s].d10_gy / dose_of(exact, 0.1), 1, 0.01);
    if (s == 0) {
      EXPECT_NEAR(doses[s].d2cc_gy / dose_of(exact, 2 / doses[s].volume_cc), 1, 0.01);
    }
  }
}

}  // namespace
}  // namespace brachy
