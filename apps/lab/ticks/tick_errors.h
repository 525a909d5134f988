#pragma once

#include <string>
#include <vector>

#include "apps/lab/compare/models.h"
#include "apps/lab/ticks/large_motion.h"

namespace brachy {

/// A model of the daemon with the settings that `[model] kernel = "auto"` chooses among.
struct ShownModel {
  std::string name;         ///< in tables: psi31, elastic, psi31_a24_surface, …
  std::string kernel;       ///< of all_model_names()
  double support_mm = 0;    ///< of a ψ kernel; 0: the default
  bool is_surface = false;  ///< ticks move as many points as a surface has, not a volume's
  int repeats = 0;          ///< updates that are timed at each level; 0: none
};

/// Every model with its defaults.
std::vector<ShownModel> default_models();
/// All that "auto" chooses among: ψ kernels at several supports; every model with the points of a volume and of a
/// surface. Timed.
std::vector<ShownModel> models_to_choose_from();

/// What a model shows of one level of a motion, against the neo-Hookean solution.
struct TickRow {
  std::string model;
  bool is_in_daemon = true;  ///< else a comparator, which has no daemon
  std::string kernel;        ///< as in ShownModel, as are support_mm and is_surface
  double support_mm = 0;
  bool is_surface = false, has_anchors = false;
  double landmark_spacing_mm = 0;  ///< 0: one landmark
  std::string scene;
  double motion_mm = 0;  ///< as in LargeMotion::Level

  double rel_l2 = 0;  ///< |u − u_ref| / |u_ref| over field.csv
  double max_mm = 0;  ///< largest |u − u_ref| there

  // Of the daemon's models.
  double missed_mm = 0;   ///< largest |u(p_i) − d_i| at the needle's landmarks
  std::string verdict;    ///< of the certificate
  double vertex_det = 1;  ///< least det(I + ∇u) at the tissue's vertices
  double held_mm = 0;     ///< clamped
  unsigned substeps = 1;  ///< composed
  bool is_late = false;   ///< some of the tissue is an earlier tick's
  /// Median time of an update or evaluation of 14,560 points (of a surface's 1,600), one thread; of a needle under
  /// forces with its tip advancing. 0: not timed.
  double evaluation_ms = 0;
  std::string error;  ///< why there is no result; then the figures are not valid
};

/// What a tick of the daemon shows by the scene's default policy: the vertices of a tissue with the reference's points.
/// The needle comes to a level from the one before it, at 50 mm/s, tick by tick; the row is of the tick in which it is
/// there. One row a level.
std::vector<TickRow> measure_ticks(const ShownModel& model, const LargeMotion& motion);

/// A comparator's field at the same points; `repeats` evaluations are timed. Not for motions by forces.
std::vector<TickRow> measure_comparator(const ModelEntry& comparator, const LargeMotion& motion, int repeats);

/// {"quick": …, "simd": …, "rows": […]} with the fields of TickRow.
std::string to_json(const std::vector<TickRow>& rows, bool quick);

/// A Markdown table: relative L2 in % of every model and scene, one figure a level.
std::string to_markdown(const std::vector<TickRow>& rows);

}  // namespace brachy
