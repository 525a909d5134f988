#pragma once

#include <span>
#include <vector>

#include "core/brachytherapy/plan/optimiser/needle_choices.h"
#include "core/brachytherapy/plan/optimiser/plan_points.h"

namespace brachy {

/// The dose of one seed at all points, as a share of the prescription, for every hole and depth at which a seed may
/// lie (NeedleLoad's rows, 0.5 mm apart): a contiguous row of floats each, tabulated once. Seeds along +z.
/// Memory: points × holes × depths × 4 bytes, 60 MB for 3,800 points and 50 holes of 40 mm.
/// The same bits on every machine (the loops' generic copy). Threads: const use from any.
class DoseRows {
 public:
  DoseRows(const std::vector<NeedleChoice>& choices, const PlanPoints& points, SourceModel source,
           double strength_u, double prescription_gy);

  /// Of a row first_row … last_row of that choice.
  const float* row(std::size_t choice, int row) const {
    return &doses_[(first_[choice] + static_cast<std::size_t>(row - lowest_[choice])) * points_];
  }
  std::size_t points() const { return points_; }

 private:
  std::size_t points_;
  std::vector<std::size_t> first_;  // row of each choice
  std::vector<int> lowest_;
  std::vector<float> doses_;
};

}  // namespace brachy
