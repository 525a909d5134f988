#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/brachytherapy/dose/dose_seed.h"
#include "core/brachytherapy/hdr/implant_settings.h"
#include "core/brachytherapy/plan/template_grid.h"

namespace brachy {

/// One catheter of a plan: a needle that stays, through a hole of the template along +z; or, as another planning system
/// has it, along a course of its own, oblique and curved.
struct PlanCatheter {
  std::string hole;             ///< of the template, "D4"; empty where there is a course
  double tip_mm = 0;            ///< of its tip beyond the template's plane
  std::vector<double> dwell_s;  ///< time at each dwell position from the tip backwards, s, ≥ 0
  std::string name = {};        ///< with a course: the applicator's
  std::vector<Vec3> course =
      {};  ///< from the tip backwards, straight between its points, at least two; mm, world
  std::vector<double> dwell_mm = {};  ///< with a course: of each dwell position behind the tip, along it

  bool has_course() const { return !course.empty(); }
  const std::string& label() const { return has_course() ? name : hole; }
  bool operator==(const PlanCatheter&) const = default;
};

/// A dwell of the source: where its middle is, which way its tip points, and how long it stays.
struct Dwell {
  std::size_t catheter = 0;      ///< index in HdrPlan::catheters
  std::size_t index = 0;         ///< in PlanCatheter::dwell_s
  Vec3 position = Vec3::Zero();  ///< mm, world frame W
  Vec3 axis = Vec3::UnitZ();     ///< unit, to the catheter's tip
  double seconds = 0;
};

/// One fraction of high-dose-rate brachytherapy: catheters, and where and how long the source dwells in them.
/// Decay during a fraction of some minutes is neglected (Ir-192: 0.004 % in ten minutes).
struct HdrPlan {
  std::string name;
  SourceModel source = SourceModel::kMicroSelectronV2;
  double source_strength_u = ImplantSettings().source_strength_u;  ///< S_K on the day
  double prescription_gy = ImplantSettings::kFractionGy;           ///< of this fraction
  double step_mm = 5;        ///< between dwell positions, of straight ones
  double tip_offset_mm = 5;  ///< of the first one behind the tip
  std::vector<PlanCatheter> catheters;

  /// Of a dwell position behind the catheter's tip.
  double offset_mm(std::size_t catheter, std::size_t dwell) const;
  /// Of one through a hole.
  double straight_offset_mm(std::size_t dwell) const {
    return tip_offset_mm + step_mm * static_cast<double>(dwell);
  }
  /// mm, world. Throws UserError where the catheter's hole is not in the grid.
  Vec3 planned_tip(const TemplateGrid& grid, std::size_t catheter) const;
  /// Where it enters: its hole, or the end of its course. mm, world; throws as planned_tip.
  Vec3 planned_entry(const TemplateGrid& grid, std::size_t catheter) const;
  /// All of them, catheter by catheter, in each from the tip backwards. Throws as planned_tip.
  std::vector<Dwell> dwells(const TemplateGrid& grid) const;
  std::vector<Dwell> dwells_in(const TemplateGrid& grid, std::size_t catheter) const;  ///< those of one
  std::vector<DoseSeed> seeds(const TemplateGrid& grid) const;                         ///< as_seeds of all
  std::size_t dwell_count() const;  ///< those of more than 0 s
  double total_s() const;

  bool operator==(const HdrPlan&) const = default;
};

/// The point of a course `offset_mm` behind its first point, along it, and the direction towards that there. Beyond its
/// ends it goes on straight. At least two points, none twice in a row.
Dwell point_along(const std::vector<Vec3>& course, double offset_mm);

/// The seed whose whole decay gives what the source gives in a dwell: S_K t ln 2/T½ for its strength. So a plan's dose
/// is computed as an implant's (ImplantDose, total_dose_gy), and is Ḋ t.
DoseSeed as_seed(const Dwell& dwell, SourceModel source, double source_strength_u);
std::vector<DoseSeed> as_seeds(const std::vector<Dwell>& dwells, SourceModel source,
                               double source_strength_u);

}  // namespace brachy
