#pragma once

#include <functional>
#include <string>

#include "core/brachytherapy/plan/plan.h"

namespace brachy {

/// The limits that a plan must meet.
struct PlanLimits {
  static constexpr double kLeastStrengthU = 1e-3, kMostStrengthU = 100;
  static constexpr double kLeastPrescriptionGy = 1, kMostPrescriptionGy = 1000;
  static constexpr double kLeastBasePlaneMm = 1, kMostBasePlaneMm = 500;
  static constexpr double kMostRetractionMm = 500;
  static constexpr std::size_t kLongestName = 200;  ///< bytes

  const TemplateGrid& grid;
  double needle_length_mm;
};

/// Refuses a file's value of `key` (without the table's name): throws UserError with its line.
using RefuseKey = std::function<void(const char* key, const std::string& what)>;

/// Checks needle n, the last one read, against the plan, the needles before it and the template.
void check_needle(const Plan& plan, std::size_t n, const PlanLimits& limits, const RefuseKey& refuse);

/// Checks the plan's name: one line of text.
void check_name(const std::string& name, const RefuseKey& refuse);

}  // namespace brachy
