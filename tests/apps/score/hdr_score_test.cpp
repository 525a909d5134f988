#include "apps/score/hdr_score.h"

#include <gtest/gtest.h>

#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_structures.h"
#include "test_paths.h"

namespace brachy {
namespace {

/// The shipped plan on the default phantom, and straight catheters where it wants them.
struct ShippedHdr {
  Scene scene = load_scene(BRACHY_SOURCE_DIR "/config/hdr.toml");
  HdrPlan plan = *load_hdr_plan(scene);
  std::vector<Structure> structures = load_structures(scene);

  std::vector<CatheterCourse> as_planned() const {
    std::vector<CatheterCourse> all;
    for (std::size_t c = 0; c < plan.catheters.size(); ++c) {
      CatheterCourse course{static_cast<std::uint32_t>(c), {}, {}};
      for (double s = 0; s <= plan.catheters[c].tip_mm; s += CatheterCourse::kStepMm)
        course.now.push_back(plan.planned_tip(scene.template_grid, c) - s * Vec3::UnitZ());
      course.rest = course.now;
      all.push_back(course);
    }
    return all;
  }
  HdrScore score(const std::vector<CatheterCourse>& catheters) const {
    return score_hdr(plan, scene.template_grid, structures, scene.dose, catheters);
  }
};

TEST(HdrScore, CathetersAsPlannedGiveThePlansDose) {
  const ShippedHdr shipped;
  const HdrScore score = shipped.score(shipped.as_planned());
  ASSERT_EQ(score.catheters.size(), shipped.plan.catheters.size());
  for (const CatheterScore& c : score.catheters) {
    EXPECT_EQ(c.needle, c.planned);
    EXPECT_LT(c.largest_mm, 1e-9);
  }
  EXPECT_TRUE(score.unplanned.empty());
  EXPECT_NEAR(score.delivered[0].v100_percent, score.plan[0].v100_percent, 1e-3);
}

TEST(HdrScore, ShallowCathetersCostCoverageAndNewTimesBringSomeOfItBack) {
  const ShippedHdr shipped;
  std::vector<CatheterCourse> shallow = shipped.as_planned();
  for (CatheterCourse& c : shallow)
    for (auto* course : {&c.now, &c.rest})
      for (Vec3& p : *course) p.z() -= 5;
  const HdrScore score = shipped.score(shallow);
  for (const CatheterScore& c : score.catheters) {
    EXPECT_NEAR(c.along_mm, -5, 1e-9);
    EXPECT_NEAR(c.across_mm, 0, 1e-9);
    EXPECT_NEAR(c.mean_mm, 5, 1e-9);
  }
  EXPECT_LT(score.delivered[0].v100_percent, score.plan[0].v100_percent - 3);
  EXPECT_GT(score.reoptimised[0].v100_percent, score.delivered[0].v100_percent);
}

TEST(HdrScore, WhatEachCatheterGivesIsWhatItGivesAloneAndTheSumIsTheWhole) {
  const ShippedHdr shipped;
  std::vector<CatheterCourse> catheters = shipped.as_planned();
  catheters.erase(catheters.begin() + 4);
  const HdrScore score = shipped.score(catheters);
  EXPECT_TRUE(score.catheters[4].mean_gy.empty()) << "missing";
  for (std::size_t s = 0; s < score.delivered.size(); ++s) {
    double sum = 0;
    for (const CatheterScore& c : score.catheters)
      if (c.needle) sum += c.mean_gy.at(s);
    EXPECT_NEAR(sum / score.delivered[s].mean_gy, 1, 1e-9) << score.delivered[s].name;
  }
  // To 0.2 %: voxels at a structure's border interpolate 1/√dose, in which doses do not add up.
  DoseSettings settings = shipped.scene.dose;
  settings.prescription_gy = shipped.plan.prescription_gy;
  ImplantDose alone(shipped.structures, settings);
  for (const std::size_t c : {std::size_t{0}, std::size_t{7}, std::size_t{17}}) {
    alone.clear();
    for (const Dwell& dwell : shipped.plan.dwells_in(shipped.scene.template_grid, c))
      alone.add(as_seed(dwell, shipped.plan.source, shipped.plan.source_strength_u));
    const std::vector<StructureDose> doses = alone.evaluate();
    for (std::size_t s = 0; s < doses.size(); ++s)
      EXPECT_NEAR(score.catheters[c].mean_gy.at(s) / doses[s].mean_gy, 1, 2e-3) << c << " " << doses[s].name;
  }
}

TEST(HdrScore, ATemplateThatIsOffByAHoleShiftsEveryCatheter) {
  const ShippedHdr shipped;
  std::vector<CatheterCourse> shifted = shipped.as_planned();
  ImplantDose lies(shipped.structures, [&] {
    DoseSettings settings = shipped.scene.dose;
    settings.prescription_gy = shipped.plan.prescription_gy;
    return settings;
  }());
  for (CatheterCourse& c : shifted)
    for (auto* course : {&c.now, &c.rest})
      for (Vec3& p : *course) p.x() += shipped.scene.template_grid.spacing_mm;
  for (Dwell dwell : shipped.plan.dwells(shipped.scene.template_grid)) {
    dwell.position.x() += shipped.scene.template_grid.spacing_mm;
    lies.add(as_seed(dwell, shipped.plan.source, shipped.plan.source_strength_u));
  }
  const HdrScore score = shipped.score(shifted);
  for (const CatheterScore& c : score.catheters) EXPECT_EQ(c.needle, c.planned);
  EXPECT_NEAR(score.delivered[0].v100_percent, lies.evaluate()[0].v100_percent, 0.01);
  ASSERT_EQ(score.findings.size(), 1u);
  EXPECT_TRUE(score.findings[0].text.starts_with("all catheters lie 5.0 mm aside (x +5.0, y +0.0)"))
      << score.findings[0].text;
  EXPECT_NEAR(score.findings[0].cost->v100_percent,
              score.delivered[0].v100_percent - score.plan[0].v100_percent, 0.01);
}

TEST(HdrScore, OneCatheterAsideShallowOrMissingIsNamedAlone) {
  const ShippedHdr shipped;
  std::vector<CatheterCourse> catheters = shipped.as_planned();
  for (auto* course : {&catheters[2].now, &catheters[2].rest})
    for (Vec3& p : *course) p.x() += 5;
  for (auto* course : {&catheters[5].now, &catheters[5].rest})
    for (Vec3& p : *course) p.z() -= 8;
  catheters.erase(catheters.begin() + 9);
  const HdrScore score = shipped.score(catheters);
  const auto hole = [&](std::size_t c) { return shipped.plan.catheters[c].hole; };
  ASSERT_EQ(score.findings.size(), 3u);
  for (const std::string& text :
       {"1 catheter lies 5.0 mm aside (x +5.0, y +0.0): " + hole(2),
        "1 catheter 8.0 mm too shallow: " + hole(5), "1 catheter is missing: " + hole(9)})
    EXPECT_TRUE(std::ranges::any_of(score.findings, [&](const Finding& f) {
      return f.text.starts_with(text);
    })) << text;
}

TEST(HdrScore, ACatheterThatIsMissingAndOneThatNobodyPlannedAreSaid) {
  const ShippedHdr shipped;
  std::vector<CatheterCourse> catheters = shipped.as_planned();
  for (auto* course : {&catheters[2].now, &catheters[2].rest})
    for (Vec3& p : *course) p.x() += 60;
  const HdrScore score = shipped.score(catheters);
  EXPECT_FALSE(score.catheters[2].needle);
  EXPECT_EQ(score.unplanned, std::vector<std::uint32_t>{2});
  for (const double s : score.reoptimised_plan.catheters[2].dwell_s) EXPECT_EQ(s, 0);
}

}  // namespace
}  // namespace brachy
