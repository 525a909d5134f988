#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/doctor/trial.h"
#include "core/choice/comparison.h"
#include "core/elastic/elastic_body.h"
#include "core/scene/scene.h"

namespace brachy {

/// A scene's model at a rate, and what came of it here.
struct Trial {
  std::string kernel;
  double support_radius_mm = 0;  ///< of a ψ kernel
  double deformation_hz = 0;
  std::optional<double> charted_error_mm;  ///< on the nearest reference scenes; none: not charted
  TrialResult result;

  double budget_ms() const { return 1000 / deformation_hz; }
};

/// A tick must leave room: its p99 is at most this share of the budget.
inline constexpr double kMostOfBudget = 0.75;
/// It may miss this share of its deadlines more than an idle thread does.
inline constexpr double kMostMissedShare = 0.001;

bool fits(const Trial& trial);

/// A model of the ladder, as the comparison charts it.
struct ChartedModel {
  std::string kernel;
  double support_radius_mm = 0;  ///< 0: not a ψ kernel
  double error_mm = 0, tick_ms = 0;
};

/// Models charted to be cheaper than the scene's by a third or more, three at most: the most accurate first, each cheaper than
/// the one before it. Those that fold are left out.
std::vector<ChartedModel> cheaper_models(const Scene& scene, const ElasticBody& body,
                                         const std::vector<ChartedRow>& rows);

/// The error that the chart gives the scene's model.
std::optional<double> charted_error_mm(const Scene& scene, const ElasticBody& body,
                                       const std::vector<ChartedRow>& rows);

/// The highest usual rate below the trial's at which such ticks would leave room; nullopt: none from 10 Hz up.
std::optional<double> lower_rate(const Trial& trial);

struct Diagnosis {
  std::vector<Trial> tried;        ///< the scene as it is first
  std::optional<std::size_t> fit;  ///< the one to take; 0: the scene as it is
};

/// Tries the scene, and where it does not fit: its model down to half the rate, then cheaper models at its rate, then its model
/// as slow as it must be. `try_it` runs a scene, and throws as try_scene.
Diagnosis diagnose(const Scene& scene, const std::function<TrialResult(const Scene&)>& try_it);

}  // namespace brachy
