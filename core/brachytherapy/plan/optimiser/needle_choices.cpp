#include "core/brachytherapy/plan/optimiser/needle_choices.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/brachytherapy/plan/gland_holes.h"
#include "core/geometry/surface/surface_bvh.h"

namespace brachy {
namespace {

constexpr double kStepMm = 1;         // along a needle, between the points where distances are measured
constexpr double kLeastDepthMm = 1;   // of a needle in the gland, from its surface
constexpr double kLeastLengthMm = 5;  // of a needle's way through the gland: one seed

class Obstacle {
 public:
  Obstacle(const std::vector<Structure>& structures, const char* name) {
    if (const Structure* found = find_structure(structures, name)) surface_.emplace(found->mesh);
  }
  /// Whether a needle through `hole` comes nearer than `clearance` on its way of `depth` mm.
  bool blocks(const Vec3& hole, double depth, double clearance) const {
    if (!surface_) return false;
    for (double z = 0; z <= depth; z += kStepMm)
      if (surface_->closest_point(hole + z * Vec3::UnitZ()).signed_distance < clearance) return true;
    return false;
  }

 private:
  std::optional<SurfaceBvh> surface_;
};

}  // namespace

bool NeedleChoice::holds(const NeedleLoad& load) const {
  if (!load.is_used()) return true;
  std::array<int, NeedleLoad::kMostElements> rows;
  const int count = load.seed_rows(rows);
  return load.tip_mm <= most_tip_mm && rows[0] <= last_row &&
         rows[static_cast<std::size_t>(count) - 1] >= first_row &&
         load.tip_mm - load.length_mm() >= least_tail_mm;
}

std::vector<NeedleChoice> find_needle_choices(const std::vector<Structure>& structures,
                                              const TemplateGrid& grid, const NeedleClearances& clearances,
                                              double needle_length_mm, BlockedHoles* blocked) {
  const Obstacle rectum(structures, "rectum"), arch(structures, "pubic_arch");
  BlockedHoles counts;
  std::vector<NeedleChoice> choices;
  for (const GlandHole& hole : find_gland_holes(structures, grid)) {
    const double reach = std::floor(std::min(hole.far_mm + clearances.beyond_ends_mm, needle_length_mm));
    const double first = std::max(hole.near_mm - clearances.beyond_ends_mm, 0.0);
    if (hole.depth_mm < kLeastDepthMm ||
        std::min(reach, std::floor(hole.far_mm)) - hole.near_mm < kLeastLengthMm)
      ++counts.too_short;
    else if (hole.urethra_mm < clearances.urethra_mm)
      ++counts.urethra;
    else if (rectum.blocks(hole.position, reach, clearances.rectum_mm))
      ++counts.rectum;
    else if (arch.blocks(hole.position, reach, clearances.pubic_arch_mm))
      ++counts.pubic_arch;
    else
      choices.push_back({hole.name, hole.position,
                         static_cast<int>(std::ceil(2 * first + PlanNeedle::kSeedMm)),
                         static_cast<int>(2 * reach), static_cast<int>(reach), 0});
  }
  if (blocked) *blocked = counts;
  return choices;
}

}  // namespace brachy
