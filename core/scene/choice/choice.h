#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/elasticity/elastic_body.h"
#include "core/scene/choice/comparison.h"
#include "core/scene/scene.h"

namespace brachy {

/// A deformation model and its row in the comparison on the reference scenes that are nearest to a scene: the
/// largest error and the longest tick among them.
struct Candidate {
  /// kernel, support, anchors, spacing, surface; the rest is of the scene with the largest error
  ChartedRow settings;
  double error_mm = 0;
  double tick_ms = 0;
};

/// Requirements on a model: the largest error, and the longest time of a tick.
struct Needs {
  double tolerance_mm = 1;
  double tick_budget_ms = 2;
  bool surface_only = false;  ///< no client uses the points inside
};

struct Choice {
  Candidate candidate;
  bool meets_needs = false;
  std::string reason;  ///< one line: the chosen model with its figures, or the requirement that none meets
};

/// The reference scenes nearest to a body, by contrast and number of free faces: a face counts as much as a factor of
/// two in contrast. The needle's motion in them does not count.
std::vector<std::string> nearest_scenes(const ElasticBody& body, const std::vector<ChartedRow>& rows);

/// Every model with a row for all of `scenes`, cheapest first.
std::vector<Candidate> candidates(const std::vector<std::string>& scenes, const std::vector<ChartedRow>& rows,
                                  bool surface_only);

/// The cheapest candidate that meets the needs and does not fold on its reference scenes; where there is none, the one
/// with the smallest error within the budget, and `meets_needs` is false. Uses the stored rows only.
Choice choose(const ElasticBody& body, const Needs& needs, const std::vector<ChartedRow>& rows);

/// Replaces `[model] kernel` = "auto" by the choice: kernel, support, anchors, landmark spacing and points. Returns any
/// other scene unchanged. `reason`, if not null, is set to the choice's reason.
Scene with_choice(const Scene& scene, std::string* reason = nullptr);

}  // namespace brachy
