#include "core/brachytherapy/plan/optimiser/plan_dose.h"

#include <algorithm>

namespace brachy {

PlannedDose::PlannedDose(const DoseRows& rows, const PointObjective& objective, std::vector<float> placed)
    : rows_(rows), objective_(objective), placed_(std::move(placed)), changed_(rows.points()) {
  placed_.resize(rows.points(), 0);
  dose_ = placed_;
  row_changes_.reserve(std::size_t{8} * NeedleLoad::kMostElements);
}

double PlannedDose::reset(std::span<const NeedleLoad> loads) {
  dose_ = placed_;
  std::array<int, NeedleLoad::kMostElements> seeds;
  for (std::size_t c = 0; c < loads.size(); ++c) {
    const int count = loads[c].is_used() ? loads[c].seed_rows(seeds) : 0;
    for (int s = 0; s < count; ++s) {
      const float* row = rows_.row(c, seeds[static_cast<std::size_t>(s)]);
      for (std::size_t i = 0; i < dose_.size(); ++i) dose_[i] += row[i];
    }
  }
  return objective_.of(dose_.data());
}

double PlannedDose::with(std::span<const LoadChange> changes) {
  row_changes_.clear();
  std::array<int, NeedleLoad::kMostElements> before, after;
  for (const LoadChange& change : changes) {
    const int n = change.before.is_used() ? change.before.seed_rows(before) : 0;
    const int m = change.after.is_used() ? change.after.seed_rows(after) : 0;
    // Both decrease: seeds that stay where they are cost nothing.
    int i = 0, j = 0;
    while (i < n || j < m) {
      const int was = i < n ? before[static_cast<std::size_t>(i)] : -1;
      const int is = j < m ? after[static_cast<std::size_t>(j)] : -1;
      if (was != is)
        row_changes_.push_back({rows_.row(change.choice, std::max(was, is)), was > is ? -1.0f : 1.0f});
      if (was >= is) ++i;
      if (is >= was) ++j;
    }
  }
  return objective_.with(dose_.data(), row_changes_, changed_.data());
}

}  // namespace brachy
