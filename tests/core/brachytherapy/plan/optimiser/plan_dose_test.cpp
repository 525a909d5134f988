#include "core/brachytherapy/plan/optimiser/plan_dose.h"

#include <gtest/gtest.h>

#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/plan/optimiser/load_moves.h"
#include "core/brachytherapy/plan/optimiser/placement_noise.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

struct Problem {
  std::vector<Structure> structures = load_structures(parse_scene("", "scene.toml"));
  std::vector<NeedleChoice> choices = find_needle_choices(structures, TemplateGrid(), {}, 200);
  PlanPoints points = plan_points(structures, {500, 70, 50, 30});
  PointObjective objective{PlanObjective::standard(), points};
  DoseRows rows{choices, points, SourceModel::kAmersham6711, 0.5, 145};
};

const Problem& problem() {
  static const Problem made;
  return made;
}

/// Follows `count` random changes, of which most are kept.
template <class Check>
void wander(PlanDose& dose, int count, const Check& check) {
  LoadMoves moves(problem().choices, std::vector<NeedleLoad>(problem().choices.size()), 25, 90,
                  NeedleLoad::kMostElements, 3);
  dose.reset(moves.loads());
  int kept = 0;
  while (kept < count) {
    const auto* changes = moves.propose();
    if (!changes) continue;
    const double then = dose.with(*changes);
    if (moves.random().share() < 0.2) continue;
    dose.keep();
    moves.keep();
    ++kept;
    check(moves, then);
  }
}

TEST(PlannedDose, ChangesGiveTheObjectiveThatALoadFromScratchHas) {
  const Problem& p = problem();
  PlannedDose dose(p.rows, p.objective);
  wander(dose, 300, [&](const LoadMoves& moves, double then) {
    PlannedDose fresh(p.rows, p.objective);
    EXPECT_NEAR(fresh.reset(moves.loads()), then, 2e-4);
  });
}

TEST(MisplacedDose, ChangesGiveTheObjectiveThatALoadFromScratchHas) {
  const Problem& p = problem();
  const PointObjective misplaced(PlanObjective::misplaced(), p.points);
  PlannedDose planned(p.rows, p.objective), other(p.rows, p.objective);
  PlacementNoise noise;
  noise.draws = 3;
  MisplacedDose dose(planned, p.choices, p.points, misplaced, SourceModel::kAmersham6711, 0.5, 145, noise);
  MisplacedDose fresh(other, p.choices, p.points, misplaced, SourceModel::kAmersham6711, 0.5, 145, noise);
  wander(dose, 60,
         [&](const LoadMoves& moves, double then) { EXPECT_NEAR(fresh.reset(moves.loads()), then, 2e-3); });
}

TEST(MisplacedDose, WithoutNoiseItIsThePlannedDose) {
  const Problem& p = problem();
  PlannedDose planned(p.rows, p.objective), alone(p.rows, p.objective);
  PlacementNoise still;
  still.sd_mm = Vec3::Zero();
  still.draws = 2;
  MisplacedDose dose(planned, p.choices, p.points, p.objective, SourceModel::kAmersham6711, 0.5, 145, still);
  std::vector<NeedleLoad> loads(p.choices.size());
  for (std::size_t c = 0; c < loads.size(); c += 3)
    loads[c] = NeedleLoad::from(p.choices[c].most_tip_mm, "s-s");
  const double of_planned = alone.reset(loads);
  EXPECT_NEAR(dose.reset(loads), 2 * of_planned, 0.02 * of_planned);  // a table of 0.25 mm
}

TEST(DoseRows, AreTheExactDoseOfASeedThere) {
  const Problem& p = problem();
  for (const std::size_t c : {std::size_t{0}, p.choices.size() / 2}) {
    const NeedleChoice& choice = p.choices[c];
    for (const int row : {choice.first_row, choice.last_row}) {
      const DoseSeed seed{choice.position + row_depth_mm(row) * Vec3::UnitZ(), Vec3::UnitZ(),
                          SourceModel::kAmersham6711, 0.5};
      for (std::size_t i = 0; i < p.points.points.size(); i += 17) {
        const double exact = total_dose_gy({&seed, 1}, p.points.points[i]) / 145;
        EXPECT_NEAR(static_cast<double>(p.rows.row(c, row)[i]), exact, 1e-3 * exact);
      }
    }
  }
}

TEST(PlannedDose, SeedsInPlaceCount) {
  const Problem& p = problem();
  std::vector<NeedleLoad> loads(p.choices.size()), none(p.choices.size());
  loads[0] = NeedleLoad::from(p.choices[0].most_tip_mm, "s");
  PlannedDose chosen(p.rows, p.objective);
  const float* row = p.rows.row(0, 2 * p.choices[0].most_tip_mm);
  PlannedDose placed(p.rows, p.objective, std::vector<float>(row, row + p.rows.points()));
  EXPECT_EQ(chosen.reset(loads), placed.reset(none));
}

}  // namespace
}  // namespace brachy
