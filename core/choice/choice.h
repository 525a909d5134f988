#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/choice/comparison.h"
#include "core/elastic/elastic_body.h"
#include "core/scene/scene.h"

namespace brachy {

/// A model of the ladder and what the comparison says of it on the reference scenes that are nearest to a scene: the
/// largest error and the dearest tick among them.
struct Candidate {
  ChartedRow
      settings;  ///< kernel, support, anchors, spacing, surface; the rest is of the scene with the largest error
  double error_mm = 0;
  double tick_ms = 0;
};

/// What a model should be, for a scene: an error it may make, and the time a tick may take.
struct Needs {
  double tolerance_mm = 1;
  double tick_budget_ms = 2;
  bool surface_only = false;  ///< nobody asks for points inside
};

struct Choice {
  Candidate candidate;
  bool meets_needs = false;
  std::string reason;  ///< one line: what was chosen, from what figures; or what is missing
};

/// The reference scenes nearest to a body: those whose contrast and number of free faces are nearest (ratio of contrasts,
/// a face as much as a factor of two), whatever the needle does in them.
std::vector<std::string> nearest_scenes(const ElasticBody& body, const std::vector<ChartedRow>& rows);

/// Every model that was run on all of `scenes`, cheapest first.
std::vector<Candidate> candidates(const std::vector<std::string>& scenes, const std::vector<ChartedRow>& rows,
                                  bool surface_only);

/// The cheapest candidate that meets the needs and does not fold on its reference scenes. Where there is none: the one
/// with the least error within the budget, and `meets_needs` is false. Decided from the stored rows alone.
Choice choose(const ElasticBody& body, const Needs& needs, const std::vector<ChartedRow>& rows);

/// A scene whose `[model] kernel` is "auto" with the choice put in its place: kernel, support, anchors, landmark spacing,
/// points. Others are returned as they are. `reason` is given the choice's line.
Scene with_choice(const Scene& scene, std::string* reason = nullptr);

}  // namespace brachy
