#pragma once

#include <vector>

namespace brachy {

/// A bevel-tip needle pushed straight into a phantom without turning. mm, N, N/mm².
struct NeedlePathSettings {
  double bending_stiffness_nmm2 = 15720;  ///< 18 G tube, 1.27 and 1.0 mm
  double needle_length_mm = 200;
  double shear_modulus = 0.006;  ///< of the phantom
  double poisson = 0.49;
  double core_mm = 2;     ///< over which a landmark's force is spread
  double spacing_mm = 5;  ///< between landmarks on the cut path
  double step_mm = 0.5;
  double depth_mm = 100;
  /// > 0: springs of so many N/mm for each mm of path, in place of the elastic solid
  double foundation_n_per_mm2 = 0;
};

/// How far the tip is off its line, mm, for a bevel's force of 1 N across it, at depths 0, step, 2 step … The
/// simulator's mechanics (core/DESIGN.md, section 5): a beam clamped at the hub, held across at the phantom's face, its
/// landmarks solved by (K + C) f = d in an unbounded elastic solid, and a tip that cuts along its tangent.
std::vector<double> needle_path(const NeedlePathSettings& settings);

}  // namespace brachy
