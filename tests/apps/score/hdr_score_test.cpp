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
