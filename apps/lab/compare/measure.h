#pragma once

#include <optional>
#include <string>

#include "apps/lab/compare/models.h"
#include "apps/lab/compare/reference_scene.h"
#include "apps/lab/compare/timing.h"

namespace brachy {

/// A model on a scene. Errors are against the reference field; times are the thread's processor time, ms.
struct CompareRow {
  std::string model, family, scene, group;
  bool counts = true;  ///< in means
  bool listed = true;  ///< by name in table and charts
  std::string kernel;
  double support_mm = 0;
  bool has_anchors = false, is_surface = false;
  double landmark_spacing_mm = 0;  ///< 0: one landmark

  double rel_l2 = 0;         ///< |u − u_ref| / |u_ref| over field.csv
  double max_mm = 0;         ///< largest |u − u_ref| there
  double target_mm = 0;      ///< mean |u − u_ref| at the targets
  double target_max_mm = 0;  ///< largest there
  double min_det = 1;        ///< least det(I + ∇u) at field and targets
  int ticks_to_rest = 0;     ///< until the field is at rest; 1 unless the model has inertia
  double setup_ms = 0;       ///< from scene and points to the first tick's end, once
  double tick_ms = 0;  ///< median of ticks whose displacements move while the landmarks' rest positions stay
  /// the same where the tip's rest position is another each tick; 0: takes another set-up
  double advance_ms = 0;
  std::size_t bytes = 0;  ///< heap it holds after the ticks
  std::string error;      ///< why the model has no result; then the figures are not valid
};

CompareRow measure(const ModelEntry& model, const ReferenceScene& scene, const Effort& effort);

}  // namespace brachy
