#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/brachytherapy/dose/dose_goal.h"
#include "core/brachytherapy/hdr/hdr_plan.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// Goals of a fraction; percent of the volume, and of the prescription. GEC/ESTRO (Hoskin et al., Radiother. Oncol.
/// 107, 2013, 325–332) asks for V100 ≥ 95 % and limits urethra D10 and rectum D2cc; these are the stricter ones that
/// boosts and monotherapy of one fraction are reported with.
struct HdrGoals {
  static constexpr double kLeastV100 = 97, kMostV150 = 35, kMostUrethraD10 = 115, kMostD2cc = 70;
};

/// The same as goals of a plan and of what is delivered, where a scene has none of its own.
std::vector<DoseGoal> hdr_dose_goals();

/// Points spread evenly over a structure: its dose at them stands for its dose-volume histogram.
struct DosePoints {
  /// kOther: reported, not limited
  enum class Role { kTarget, kUrethra, kRectum, kBladder, kOther };
  static Role role_of(std::string_view name);

  Role role;
  std::vector<Vec3> points;  ///< mm, world frame W
  double volume_cc;
};

/// The points of the structures that have a role: the first one is the target. `share` of the full number, 6,500 for a
/// gland, a urethra and a rectum. Deterministic. Errors: UserError as fill_interior.
std::vector<DosePoints> dose_points(const std::vector<Structure>& structures, double share = 1);

/// Dose of the dwell positions at the points, as a share of the prescription for each second: a row for each point, by
/// TG-43U1 in double (core/brachytherapy/dose/dose_rate.h).
class DwellDoses {
 public:
  DwellDoses(const std::vector<Dwell>& positions, const std::vector<DosePoints>& structures,
             SourceModel source, double source_strength_u, double prescription_gy);

  struct Rows {
    DosePoints::Role role;
    std::size_t first, count;
    double volume_cc;
  };
  std::size_t dwells() const { return dwells_; }
  const std::vector<Rows>& structures() const { return structures_; }
  const double* row(std::size_t point) const { return &share_per_s_[point * dwells_]; }

  /// The doses of one structure for these times, shares of the prescription, decreasing.
  std::vector<double> doses(const Rows& structure, const std::vector<double>& seconds) const;
  /// This matrix with only those dwell positions.
  DwellDoses with(const std::vector<std::size_t>& dwells) const;

 private:
  DwellDoses() = default;

  std::size_t dwells_ = 0;
  std::vector<Rows> structures_;
  std::vector<double> share_per_s_;
};

/// The figures that the optimiser's goals are of; 0 for a structure that the scene has not.
struct HdrFigures {
  double v100_percent = 0, v150_percent = 0;
  double urethra_d10_percent = 0, rectum_d2cc_percent = 0, bladder_d2cc_percent = 0;

  /// How far the goals are missed: the sum over them of the excess as a share of the goal; 0: all are met. `margin`: by
  /// how much each is to be exceeded.
  double missed(double margin = 0) const;
};
HdrFigures hdr_figures(const DwellDoses& doses, const std::vector<double>& seconds);

}  // namespace brachy
