#include "core/brachytherapy/plan/optimiser/needle_load.h"

#include <cassert>

namespace brachy {
namespace {

// In half millimetres.
constexpr int kSeedHalves = static_cast<int>(2 * PlanNeedle::kSeedMm),
              kSpacerHalves = static_cast<int>(2 * PlanNeedle::kSpacerMm);
static_assert(0.5 * kSeedHalves == PlanNeedle::kSeedMm && 0.5 * kSpacerHalves == PlanNeedle::kSpacerMm);

}  // namespace

double NeedleLoad::length_mm() const {
  const int count = seed_count();
  return 0.5 * (kSeedHalves * count + kSpacerHalves * (elements - count));
}

int NeedleLoad::seed_rows(std::array<int, kMostElements>& rows) const {
  int count = 0, behind = 0;
  for (int e = 0; e < elements; ++e) {
    if (is_seed(e)) rows[static_cast<std::size_t>(count++)] = 2 * tip_mm - behind;
    behind += is_seed(e) ? kSeedHalves : kSpacerHalves;
  }
  return count;
}

void NeedleLoad::trim() {
  while (elements > 0 && !is_seed(elements - 1)) --elements;
  // Two spacers are 11 mm; one alone is not a whole number of them.
  while (elements > 2 && (seeds & 3) == 0) {
    seeds >>= 2;
    elements -= 2;
    tip_mm -= kSpacerHalves;
  }
}

std::string NeedleLoad::train() const {
  std::string text;
  for (int e = 0; e < elements; ++e) text += is_seed(e) ? 's' : '-';
  return text;
}

NeedleLoad NeedleLoad::from(int tip_mm, const std::string& train) {
  assert(train.size() <= static_cast<std::size_t>(kMostElements));
  NeedleLoad load{tip_mm, static_cast<int>(train.size()), 0};
  for (std::size_t e = 0; e < train.size(); ++e)
    if (train[e] == 's') load.seeds |= std::uint32_t{1} << e;
  return load;
}

}  // namespace brachy
