#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace brachy {

/// One row of the stored comparison: what ticks of a model show of a large motion (`brachy ticks --choices`,
/// scripts/charts/ticks.sh --store).
struct ChartedRow {
  std::string model;               ///< psi31_a12, elastic_surface, …
  std::string kernel;              ///< a model (core/models/matrix_kernel/matrix_models.h)
  double support_mm = 0;           ///< of a ψ kernel; 0: none
  bool has_anchors = false;        ///< the default scene's eight
  double landmark_spacing_mm = 0;  ///< on the shaft; 0: one landmark
  bool is_surface = false;         ///< ticks move a surface's points, not a volume's 14,560
  std::string scene;               ///< folder of tests/reference/large_motion
  double contrast = 1;             ///< the gland's shear modulus over its surround's
  double poisson = 0.49;
  int free_faces = 0;
  double error_mm = 0;  ///< largest in the gland a needle's radius from it, at motions of up to 8 mm
  double tick_ms = 0;   ///< median tick of these motions, under forces with the tip advancing; one thread
  double min_det = 1;   ///< least det(I + ∇u); ≤ 0: the field folds
};

/// What `brachy ticks` measured when core/scene/choice/comparison.csv was stored; built into the library.
const std::vector<ChartedRow>& stored_comparison();

/// Rows of such a CSV. UserError "name:line: …".
std::vector<ChartedRow> parse_comparison(std::string_view text, const std::string& name);

}  // namespace brachy
