#pragma once

#include <span>
#include <vector>

#include "core/brachytherapy/plan/optimiser/dose_rows.h"
#include "core/brachytherapy/plan/optimiser/needle_load.h"
#include "core/brachytherapy/plan/optimiser/plan_objective.h"

namespace brachy {

/// One needle of a proposal: what it held and what it is to hold.
struct LoadChange {
  std::size_t choice;
  NeedleLoad before, after;
};

/// A plan's dose and its penalties, kept up to date from change to change: what the annealer asks.
class PlanDose {
 public:
  virtual ~PlanDose() = default;
  /// From scratch; `loads`: of all choices. The penalties.
  virtual double reset(std::span<const NeedleLoad> loads) = 0;
  /// The penalties with these changes, none of which is made.
  virtual double with(std::span<const LoadChange> changes) = 0;
  /// Makes the changes of the last with().
  virtual void keep() = 0;
};

/// The dose of seeds where they are planned, from tabulated rows.
class PlannedDose final : public PlanDose {
 public:
  /// `placed`: the dose of seeds that are already in place, at all points, or empty.
  PlannedDose(const DoseRows& rows, const PointObjective& objective, std::vector<float> placed = {});

  double reset(std::span<const NeedleLoad> loads) override;
  double with(std::span<const LoadChange> changes) override;
  void keep() override { std::swap(dose_, changed_); }

 private:
  const DoseRows& rows_;
  const PointObjective& objective_;
  std::vector<float> placed_, dose_, changed_;
  std::vector<RowChange> row_changes_;
};

}  // namespace brachy
