#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace brachy {

/// Where one method fails along one swept parameter; or, of kind "law", a constant that core/DESIGN.md,
/// section 4, states and a sweep measured.
/// Kinds: fold (det ≤ 0), singular (condition above 1e12), not definite (no Cholesky factor, or a determinant
/// that changed sign), inaccurate (a landmark missed by more than 1e-3 mm, or by what the sweep's name says),
/// overshoot, diverges, order, locking, not finite, refused (by name, before it could fail), fixed; law.
struct StabilityRow {
  /// psi31, …, fem, thin_plate, multiquadric, mass_spring, chainmail; phi: Φ of compact_elastic
  std::string method = {};
  std::string sweep = {};                 ///< what is swept, and on what: "push, one landmark"
  std::string parameter = {};             ///< what at_failure counts: "|d|/a", "mm", "a/q", …
  std::optional<double> at_failure = {};  ///< none: it did not fail up to `swept_to`
  double swept_to = 0;                    ///< where the sweep ended, or was to end
  std::string kind = {};                  ///< of the failure, below
  std::optional<double> theory = {};      ///< of core/DESIGN.md, section 4, or derived in the sweep's file
  std::optional<std::array<double, 2>> theory_range = {};  ///< where core/DESIGN.md gives a range instead
};

/// Figures along a sweep, for the charts.
struct StabilityCurve {
  std::string method, sweep, parameter;
  std::vector<double> at;                        ///< values of the parameter
  std::vector<double> condition = {};            ///< of the landmark system; empty: not computed
  std::vector<double> condition_by_theory = {};  ///< n over section 4's λmin; empty: there is none
  std::vector<double> min_det = {};              ///< least det(I + ∇u); empty: not computed
};

/// The border of failure in the plane of spacing / support and push / support.
struct PlaneBorder {
  std::string method;
  std::string load;  ///< which landmarks are pushed; empty: the border is a spacing, whatever the push
  std::string kind;  ///< as in StabilityRow
  std::vector<double> spacing;  ///< over the support; one for a border without pushes
  std::vector<double> push;     ///< over the support
};

struct StabilityReport {
  bool quick = false;
  std::vector<StabilityRow> rows;
  std::vector<StabilityCurve> curves;
  std::vector<PlaneBorder> plane;
};

std::string to_json(const StabilityReport& report);
/// The rows as a Markdown table.
std::string to_markdown(const std::vector<StabilityRow>& rows);
/// One line per point: method,sweep,parameter,at,condition,condition_by_theory,min_det.
std::string to_csv(const std::vector<StabilityCurve>& curves);
/// One line per point: method,load,kind,spacing,push.
std::string to_csv(const std::vector<PlaneBorder>& plane);

}  // namespace brachy
