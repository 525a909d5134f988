#include "haptics/trajectory/needle_metrics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/surface/surface_check.h"
#include "tests/data_dir.h"

namespace brachy {
namespace {

/// Tissue is the half space z > 0.
const InsideTest kBelow = [](const Vec3& p) { return p.z() > 0; };

/// A needle along +z with its tip at (0, 0, z) at each time.
std::vector<TrajectorySample> along_z(const std::vector<std::pair<double, double>>& t_and_z) {
  std::vector<TrajectorySample> samples;
  for (const auto& [t_s, z] : t_and_z) samples.push_back({t_s, {Mat3::Identity(), Vec3(0, 0, z)}});
  return samples;
}

NeedleMetrics metrics_of(const std::vector<TrajectorySample>& motion, const InsideTest& inside = kBelow) {
  NeedleMetricsTally tally;
  tally.add(motion, tissue_visits(motion, inside));
  return tally.result();
}

TEST(NeedleMetrics, ASegmentCountsWhenItsEndIsInside) {
  // In from −10 to 20 in 1 s, on to 25 in 2 s, out to −5 in 4 s.
  const NeedleMetrics m = metrics_of(along_z({{1, -10}, {2, 20}, {4, 25}, {8, -5}}));
  EXPECT_EQ(m.poses, 4u);
  EXPECT_EQ(m.elapsed_time_s, 7);
  EXPECT_EQ(m.path_length_mm, 65);
  EXPECT_EQ(m.path_in_tissue_mm, 35);
  EXPECT_EQ(m.time_in_tissue_s, 3);
  EXPECT_EQ(m.passes, 1u);
}

TEST(NeedleMetrics, VisitsAreTheStretchesWithTheTipInside) {
  const auto motion = along_z({{0, -2}, {1, 2}, {2, 4}, {3, -2}, {4, -3}, {5, 3}});
  const std::vector<TissueVisit> visits = tissue_visits(motion, kBelow);
  ASSERT_EQ(visits.size(), 2u);
  EXPECT_EQ(visits[0].first, 1u);
  EXPECT_EQ(visits[0].end, 3u);
  EXPECT_EQ(visits[0].path_mm, 6);
  EXPECT_EQ(visits[0].time_s, 2);
  EXPECT_EQ(visits[1].first, 5u);
  EXPECT_EQ(visits[1].end, 6u);
  EXPECT_EQ(visits[1].path_mm, 6);
}

TEST(NeedleMetrics, ATipThatTremblesOnTheSurfaceIsOnePass) {
  // ±1 mm along the needle must be inside too, and all three outside again before the next one counts.
  EXPECT_EQ(metrics_of(along_z({{0, -2}, {1, 0.5}, {2, -0.5}, {3, 0.5}, {4, -2}})).passes, 0u);
  EXPECT_EQ(metrics_of(along_z({{0, -2}, {1, 2}, {2, -0.5}, {3, 2}, {4, -2}})).passes, 1u);
  EXPECT_EQ(metrics_of(along_z({{0, -2}, {1, 2}, {2, -2}, {3, 2}, {4, -2}})).passes, 2u);
  EXPECT_EQ(metrics_of(along_z({{0, 5}, {1, 6}})).passes, 1u);
}

TEST(NeedleMetrics, TheMillimetreIsAlongTheNeedle) {
  // Across the surface's normal the points beside the tip are as deep as the tip.
  auto motion = along_z({{0, -2}, {1, 0.5}, {2, -2}});
  for (TrajectorySample& s : motion)
    s.X_WN.R = Eigen::AngleAxisd(std::acos(0.0), Vec3::UnitX()).toRotationMatrix();
  EXPECT_EQ(metrics_of(motion).passes, 1u);
}

TEST(NeedleMetrics, PercentilesOfSegmentSpeedsAreLinearInRank) {
  // Speeds 10, 20, 30, 40, 50 mm/s in some order; numpy.percentile gives 30, 46, 48, 50.
  const NeedleMetrics m =
      metrics_of(along_z({{0, -500}, {1, -470}, {3, -450}, {3.5, -475}, {4.5, -455}, {5.5, -415}}));
  EXPECT_NEAR(m.speed_p50_mm_s, 30, 1e-12);
  EXPECT_NEAR(m.speed_p90_mm_s, 46, 1e-12);
  EXPECT_NEAR(m.speed_p95_mm_s, 48, 1e-12);
  EXPECT_EQ(m.speed_max_mm_s, 50);
  EXPECT_EQ(m.time_in_tissue_s, 0);
}

TEST(NeedleMetrics, OnlyATipThatMovesHasASpeed) {
  // A hand at 20 mm/s for a tenth of the time, seen 200 times a second; numpy.percentile of its moving segments is 20.
  std::vector<std::pair<double, double>> places;
  double z = -50;
  for (int i = 0; i < 2000; ++i) places.push_back({0.005 * i, i % 200 < 20 ? z += 0.1 : z});
  const NeedleMetrics rested = metrics_of(along_z(places));
  EXPECT_NEAR(rested.speed_p50_mm_s, 20, 1e-9);
  EXPECT_NEAR(rested.speed_p95_mm_s, 20, 1e-9);
  EXPECT_NEAR(rested.path_length_mm, 0.1 * 199, 1e-9);

  // A mouse of 50 poses a second at 40 mm/s in the same samples: each pose stays for four of them.
  places.clear();
  for (int i = 0; i < 400; ++i) places.push_back({0.005 * i, -50 + 0.8 * (i / 4)});
  const NeedleMetrics held = metrics_of(along_z(places));
  EXPECT_NEAR(held.speed_p50_mm_s, 40, 1e-9);
  EXPECT_NEAR(held.speed_max_mm_s, 40, 1e-9);

  EXPECT_TRUE(std::isnan(metrics_of(along_z({{0, 5}, {1, 5}, {2, 5}})).speed_p95_mm_s)) << "it never moved";
}

TEST(NeedleMetrics, APoseAloneHasNoSpeed) {
  const NeedleMetrics m = metrics_of(along_z({{3, 5}}));
  EXPECT_EQ(m.elapsed_time_s, 0);
  EXPECT_EQ(m.path_in_tissue_mm, 0);
  EXPECT_TRUE(std::isnan(m.speed_p50_mm_s));
  EXPECT_TRUE(std::isnan(m.speed_max_mm_s));
}

TEST(NeedleMetrics, SeveralNeedlesAddUpOnOneClock) {
  NeedleMetricsTally tally;
  for (const auto& motion : {along_z({{0, -10}, {1, 20}}), along_z({{2, -1}, {4, 9}})})
    tally.add(motion, tissue_visits(motion, kBelow));
  tally.add({}, {});
  const NeedleMetrics m = tally.result();
  EXPECT_EQ(m.poses, 4u);
  EXPECT_EQ(m.elapsed_time_s, 4);
  EXPECT_EQ(m.path_length_mm, 40);
  EXPECT_EQ(m.path_in_tissue_mm, 40);
  EXPECT_EQ(m.time_in_tissue_s, 3);
  EXPECT_EQ(m.passes, 2u);
  EXPECT_EQ(m.speed_max_mm_s, 30);
  EXPECT_NEAR(m.speed_p50_mm_s, 17.5, 1e-12);
}

TEST(NeedleMetrics, TheRecordedInsertionIsAsPublished) {
  BRACHY_REQUIRE_DATA(data);
  const Trajectory motion = load_trajectory(data / "trajectories" / "inplane_needle_tip.csv");
  const SurfaceBvh tissue(
      prepare_surface(read_mesh_file(data / "meshes" / "inplane_tissue.stl"), {}, "tissue").mesh);
  const NeedleMetrics m = metrics_of(motion.samples(), [&](const Vec3& p) { return tissue.inside(p); });
  // PerkTutor, Data/InPlane/TrueMetricsTable.tsv; six digits there.
  EXPECT_NEAR(m.elapsed_time_s, 27.437, 1e-4 * 27.437);
  EXPECT_NEAR(m.path_length_mm, 280.892, 1e-4 * 280.892);
  EXPECT_NEAR(m.path_in_tissue_mm, 164.915, 1e-4 * 164.915);
  EXPECT_NEAR(m.time_in_tissue_s, 21.866, 1e-4 * 21.866);
  EXPECT_EQ(m.passes, 1u);
}

}  // namespace
}  // namespace brachy
