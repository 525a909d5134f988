#include "core/brachytherapy/plan/plan.h"

#include <algorithm>

#include "core/base/error.h"

namespace brachy {

std::vector<double> PlanNeedle::seed_offsets_mm() const {
  std::vector<double> offsets;
  double behind = 0;
  for (const char c : train) {
    if (c == 's') offsets.push_back(behind + 0.5 * kSeedMm);
    behind += c == 's' ? kSeedMm : kSpacerMm;
  }
  return offsets;
}

double PlanNeedle::train_length_mm() const {
  double length = 0;
  for (const char c : train) length += c == 's' ? kSeedMm : kSpacerMm;
  return length;
}

Vec3 Plan::planned_tip(const TemplateGrid& grid, std::size_t needle) const {
  const PlanNeedle& n = needles.at(needle);
  const auto hole = grid.position(n.hole);
  if (!hole) throw UserError("the plan's hole is \"" + n.hole + "\"; " + grid.lacks(n.hole));
  return *hole + (base_plane_mm - n.retraction_mm) * Vec3::UnitZ();
}

std::vector<PlannedSeed> Plan::seeds(const TemplateGrid& grid) const {
  std::vector<PlannedSeed> all;
  for (std::size_t n = 0; n < needles.size(); ++n) {
    const Vec3 tip = planned_tip(grid, n);
    for (const double offset : needles[n].seed_offsets_mm())
      all.push_back({{tip - offset * Vec3::UnitZ(), Vec3::UnitZ(), source, air_kerma_strength_u}, n, offset});
  }
  return all;
}

std::size_t Plan::seed_count() const {
  std::size_t count = 0;
  for (const PlanNeedle& n : needles) count += static_cast<std::size_t>(std::ranges::count(n.train, 's'));
  return count;
}

}  // namespace brachy
