#include "apps/reports/certificate_tally.h"

#include <gtest/gtest.h>

#include <limits>

#include "apps/reports/certificate_report.h"

namespace brachy {
namespace {

Certificate certificate(Verdict verdict, double det_bound, double vertex_det) {
  Certificate c;
  c.verdict = verdict;
  c.det_bound = det_bound;
  c.vertex_det = vertex_det;
  return c;
}

TEST(CertificateTally, CountsByVerdictAndByGuard) {
  CertificateTally tally;
  Certificate guarded = certificate(Verdict::kInjective, 0.25, 0.5);
  guarded.substeps = 4;
  guarded.held_mm = 2.1;
  guarded.condition = 1e5;
  tally.add(guarded, kStepSubstepped | kStepClamped | kStepMerged, 0, true);
  tally.add(Certificate{}, 0, 0, true);
  tally.add(certificate(Verdict::kFolded, Certificate::kNotKnown, -0.5), kStepFolded | kStepDropped, 0, true);
  tally.add(certificate(Verdict::kUnknown, Certificate::kNotKnown, 0.125), kStepUncertified | kStepSteep, 0,
            true);
  EXPECT_EQ(tally.injective, 2u);
  EXPECT_EQ(tally.folded, 1u);
  EXPECT_EQ(tally.unknown, 1u);
  EXPECT_EQ(tally.unflagged, 0u);
  EXPECT_EQ(tally.nonfinite, 0u);
  EXPECT_EQ(tally.substepped, 1u);
  EXPECT_EQ(tally.clamped, 1u);
  EXPECT_EQ(tally.merged, 1u);
  EXPECT_EQ(tally.dropped, 1u);
  EXPECT_EQ(tally.steep, 1u);
  EXPECT_EQ(tally.min_det_bound, 0.25);
  EXPECT_EQ(tally.min_vertex_det, -0.5);
  EXPECT_EQ(tally.max_substeps, 4u);
  EXPECT_EQ(tally.max_held_mm, 2.1);
  EXPECT_EQ(tally.max_condition, 1e5);
}

TEST(CertificateTally, OfTicksTheLargestLagIsKept) {
  CertificateTally tally;
  EXPECT_TRUE(std::isnan(tally.max_lag_mm));
  TickSummary summary;
  tally.add(summary, true);
  EXPECT_EQ(tally.max_lag_mm, 0);
  EXPECT_EQ(tally.late, 0u);
  summary.step_flags = kStepLate;
  summary.lag_mm = 0.25;
  tally.add(summary, true);
  summary.lag_mm = 0.125;
  tally.add(summary, true);
  EXPECT_EQ(tally.max_lag_mm, 0.25);
  EXPECT_EQ(tally.late, 2u);
  EXPECT_NE(to_text("ticks", tally).find(", 2 late (tissue at most 0.25 mm behind)"), std::string::npos);
}

TEST(CertificateTally, OfFramesThatDoNotTellTheirLagOnlyTheLateOnesAreCounted) {
  CertificateTally tally;
  tally.add({}, kStepLate | kStepUncertified, Certificate::kNotKnown, true);
  EXPECT_TRUE(std::isnan(tally.max_lag_mm));
  EXPECT_NE(to_text("frames", tally).find(", 1 late\n"), std::string::npos);
  tally.add({}, kStepLate | kStepUncertified, 0.5, true);
  tally.add({}, kStepLate | kStepUncertified, Certificate::kNotKnown, true);
  EXPECT_EQ(tally.max_lag_mm, 0.5);
  EXPECT_NE(to_text("frames", tally).find(", 3 late (tissue at most 0.50 mm behind)"), std::string::npos);
}

TEST(CertificateTally, AVerdictThatItsOwnFlagDoesNotTellIsUnflagged) {
  CertificateTally tally;
  tally.add(certificate(Verdict::kFolded, Certificate::kNotKnown, 0), kStepUncertified, 0, true);
  tally.add(certificate(Verdict::kUnknown, Certificate::kNotKnown, 0), kStepFolded, 0, true);
  tally.add({}, 0, 0, true);
  tally.add(certificate(static_cast<Verdict>(9), 1, 1), 0, 0, true);  // of a later version
  EXPECT_EQ(tally.unflagged, 4u);
  EXPECT_EQ(tally.folded, 1u);
  EXPECT_EQ(tally.unknown, 3u);
}

TEST(CertificateTally, WhatNoTickKnewIsNotKnown) {
  CertificateTally tally;
  tally.add({}, kStepUncertified, Certificate::kNotKnown, true);
  EXPECT_TRUE(std::isnan(tally.min_det_bound));
  nlohmann::ordered_json json;
  add_to_json(json, "frames", tally);
  EXPECT_EQ(nlohmann::json::parse(json.dump()).at("min_det_bound"), nullptr);
  EXPECT_EQ(nlohmann::json::parse(json.dump()).at("max_lag_mm"), nullptr);
  EXPECT_EQ(json.at("frames_unknown"), 1);
  EXPECT_NE(to_text("frames", tally).find("bound not known"), std::string::npos);
}

TEST(CertificateTally, OneCoordinateThatIsNotFiniteIsFoundWhereverItChanged) {
  std::vector<Block> blocks;
  for (std::uint32_t b = 0; b < 3; ++b) blocks.push_back({2 * b, 2, Vec3::Zero(), Vec3::Zero()});
  MeshState state;
  state.summary.tick = 7;
  state.mesh.block_ticks = {7, 3, 7};
  constexpr float kInf = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < 18; ++i)
    for (const float bad : {kInf, -kInf, std::numeric_limits<float>::quiet_NaN()}) {
      state.mesh.deformed_vertices.assign(18, std::numeric_limits<float>::max());
      EXPECT_TRUE(changes_are_finite(state, blocks));
      state.mesh.deformed_vertices[i] = bad;
      const bool changed = i / 6 != 1;
      EXPECT_EQ(changes_are_finite(state, blocks), !changed) << i;
    }
  CertificateTally tally;
  tally.add(Certificate{}, 0, 0, false);
  EXPECT_EQ(tally.nonfinite, 1u);
}

TEST(CertificateReport, ALiveLineShowsTheVerdictTheLeastDetTheGuardAndTheLag) {
  EXPECT_EQ(one_line({}, 0, 0), "unknown");
  EXPECT_EQ(one_line({}, kStepLate, 0.354), "unknown late 0.35 mm");
  EXPECT_EQ(one_line(Certificate{}, 0, 0.004), "injective det 1.000");
  EXPECT_EQ(one_line(Certificate{}, kStepLate, Certificate::kNotKnown), "injective det 1.000 late");
  EXPECT_EQ(one_line(certificate(Verdict::kFolded, Certificate::kNotKnown, -0.25), kStepFolded, 0),
            "folded det -0.250");
  Certificate guarded = certificate(Verdict::kInjective, 0.125, 0.5);
  guarded.substeps = 3;
  guarded.held_mm = 2.14;
  EXPECT_EQ(one_line(guarded, kStepSubstepped | kStepClamped | kStepLate, 1.5),
            "injective det 0.125 sub-steps 3 held 2.1 mm late 1.50 mm");
}

}  // namespace
}  // namespace brachy
