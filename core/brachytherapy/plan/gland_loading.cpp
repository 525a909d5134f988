#include "core/brachytherapy/plan/gland_loading.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace brachy {
namespace {

using Holes = std::vector<GlandHole>;

double gap_to(const Holes& chosen, const GlandHole& hole) {
  double gap = std::numeric_limits<double>::infinity();
  for (const GlandHole& other : chosen) gap = std::min(gap, (other.position - hole.position).norm());
  return gap;
}

bool is_rim(const GlandHole& hole) {
  return hole.depth_mm < LoadingRule::kRimDepth;
}

Holes choose_needles(const Holes& holes, const LoadingRule& rule) {
  Holes candidates, chosen;
  std::ranges::copy_if(holes, std::back_inserter(candidates), [&](const GlandHole& h) {
    return h.depth_mm >= LoadingRule::kLeastDepth && h.far_mm - h.near_mm >= LoadingRule::kLeastLength &&
           h.urethra_mm >= rule.urethra_clearance;
  });
  std::ranges::stable_sort(candidates, {}, &GlandHole::depth_mm);
  for (const GlandHole& hole : candidates)
    if (is_rim(hole) && gap_to(chosen, hole) >= rule.spacing) chosen.push_back(hole);
  std::erase_if(candidates, is_rim);
  const auto farther = [&](const GlandHole& a, const GlandHole& b) {
    return gap_to(chosen, a) < gap_to(chosen, b);
  };
  while (!candidates.empty()) {
    const auto next = std::ranges::max_element(candidates, farther);
    if (gap_to(chosen, *next) < rule.spacing) break;
    chosen.push_back(*next);
    candidates.erase(next);
  }
  std::ranges::stable_sort(chosen, [](const GlandHole& a, const GlandHole& b) {
    return a.position.y() != b.position.y() ? a.position.y() > b.position.y()
                                            : a.position.x() < b.position.x();
  });
  return chosen;
}

/// How many spacers lie in each gap between a needle's seeds.
std::vector<int> spread_evenly(int spacers, int gaps) {
  const auto before = [&](int gap) { return (2 * gap * spacers + gaps) / (2 * gaps); };  // rounded
  std::vector<int> in_gap(static_cast<std::size_t>(gaps));
  for (int g = 0; g < gaps; ++g) in_gap[static_cast<std::size_t>(g)] = before(g + 1) - before(g);
  return in_gap;
}

/// All in the middle gap, or in the two beside the middle seed.
std::vector<int> spread_amid(int spacers, int gaps) {
  std::vector<int> in_gap(static_cast<std::size_t>(gaps), 0);
  const int middle = gaps / 2;
  for (int k = 0; k < spacers; ++k) ++in_gap[static_cast<std::size_t>(gaps % 2 ? middle : middle - k % 2)];
  return in_gap;
}

/// A train of at most `length` mm; at least two seeds, or one where only one fits.
std::string train_of(double length, bool rim, const LoadingRule& rule) {
  const double pitch = rim ? rule.rim_pitch : rule.interior_pitch;
  const int wanted = std::max(2, static_cast<int>(std::lround((length - PlanNeedle::kSeedMm) / pitch)) + 1);
  const int seeds = std::clamp(wanted, 1, static_cast<int>(length / PlanNeedle::kSeedMm));
  if (seeds == 1) return "s";
  const auto spacers = static_cast<int>((length - PlanNeedle::kSeedMm * seeds) / PlanNeedle::kSpacerMm);
  std::string train = "s";
  for (const int between : rim ? spread_evenly(spacers, seeds - 1) : spread_amid(spacers, seeds - 1))
    train += std::string(static_cast<std::size_t>(between), '-') + "s";
  return train;
}

}  // namespace

Plan load_gland(const std::vector<GlandHole>& holes, const LoadingRule& rule) {
  Plan plan;
  plan.air_kerma_strength_u = 1;
  const Holes chosen = choose_needles(holes, rule);
  for (const GlandHole& hole : chosen)
    plan.base_plane_mm = std::max(plan.base_plane_mm, std::floor(hole.far_mm));
  for (const GlandHole& hole : chosen) {
    const double far = std::floor(hole.far_mm), length = far - (hole.near_mm - 0.5 * PlanNeedle::kSeedMm);
    PlanNeedle needle{hole.name, 0, train_of(length, is_rim(hole), rule)};
    const double spare = length - needle.train_length_mm();
    needle.retraction_mm = plan.base_plane_mm - far + std::floor(0.5 * spare);
    plan.needles.push_back(std::move(needle));
  }
  return plan;
}

}  // namespace brachy
