#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/doctor/trial.h"
#include "core/elasticity/elastic_body.h"
#include "core/scene/choice/comparison.h"
#include "core/scene/scene.h"

namespace brachy {

/// A scene's model at a rate, and its measurement on this machine.
struct Trial {
  std::string kernel;
  double support_radius_mm = 0;  ///< of a ψ kernel
  double deformation_hz = 0;
  std::optional<double> charted_error_mm;  ///< on the nearest reference scenes; none: not charted
  TrialResult result;

  double budget_ms() const { return 1000 / deformation_hz; }
};

/// The p99 of the tick time is at most this share of the period.
inline constexpr double kMostOfBudget = 0.75;
/// It may miss at most this share of its deadlines in excess of an idle thread.
inline constexpr double kMostMissedShare = 0.001;

bool fits(const Trial& trial);

/// An idle thread that misses more than this share of its deadlines is on a machine that does other work: how a scene's
/// ticks do there says nothing of the scene.
inline constexpr double kMostIdleMissedShare = 0.01;

bool is_busy(const TrialResult& result);

/// A deformation model as charted by the stored comparison.
struct ChartedModel {
  std::string kernel;
  double support_radius_mm = 0;  ///< 0: not a ψ kernel
  double error_mm = 0, tick_ms = 0;
};

/// At most three models charted as cheaper than the scene's by a third or more: the most accurate first, each
/// cheaper than the one before it. Models that fold are excluded.
std::vector<ChartedModel> cheaper_models(const Scene& scene, const ElasticBody& body,
                                         const std::vector<ChartedRow>& rows);

/// The error that the chart gives the scene's model.
std::optional<double> charted_error_mm(const Scene& scene, const ElasticBody& body,
                                       const std::vector<ChartedRow>& rows);

/// The highest usual rate below the trial's at which such ticks would fit; nullopt: none from 10 Hz up.
std::optional<double> lower_rate(const Trial& trial);

struct Diagnosis {
  std::vector<Trial> tried;        ///< the scene as it is first
  std::optional<std::size_t> fit;  ///< the recommended one; 0: the scene as it is
};

/// Tries the scene; on a busy machine nothing else, as that says nothing of it. If it does not fit, its model down to
/// half the rate, then cheaper models at the full rate, then its model at ever lower rates. `run_trial` runs a scene,
/// and throws as try_scene.
Diagnosis diagnose(const Scene& scene, const std::function<TrialResult(const Scene&)>& run_trial);

}  // namespace brachy
