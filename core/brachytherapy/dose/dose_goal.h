#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/brachytherapy/dose/dvh.h"

namespace brachy {

/// A number that reports give of a structure's dose.
struct DoseIndex {
  enum class Unit { kPercent, kCc, kGy };

  const char* name;  ///< "V100", of the volume; "V100cc"; "D90"
  double StructureDose::*value;
  Unit unit;
};

/// All of them: V100, V150, V200 (%), V100cc (cm³), D90, D30, D10, D5, D2cc, D0.1cc (Gy).
std::span<const DoseIndex> dose_indices();
const DoseIndex* find_dose_index(std::string_view name);  ///< null: there is none
const char* unit_text(DoseIndex::Unit unit);

/// What a figure should be, of a plan or of the implant as it was made.
struct DoseGoal {
  std::string structure = {}, figure = {};
  std::string stage = "implant";  ///< "plan" or "implant"
  std::string side = "above";     ///< of the limit the figure should be: "above" or "below"
  double limit = 0;               ///< in the figure's unit; of doses, in % of the prescription
  std::string source = {};        ///< who recommends it
  std::string place = {};         ///< file:line, for messages

  bool is_of_plan() const { return stage == "plan"; }
  bool is_above() const { return side == "above"; }
  double limit_for(double prescription_gy) const;               ///< in the figure's unit
  double value_in(std::span<const StructureDose> doses) const;  ///< NaN where its structure is not there
  bool is_met_by(double value, double prescription_gy) const;   ///< NaN: false
  bool operator==(const DoseGoal&) const = default;
};

/// The rule set of a scene that has none of its own, for permanent implants of the prostate; its entries name their
/// sources: ABS (Davis et al., Brachytherapy 11 (2012) 6–19), GEC-ESTRO/EAU/EORTC (Salembier et al., Radiother.
/// Oncol. 83 (2007) 3–10) and AAPM TG-137 (Nath et al., Med. Phys. 36 (2009) 5310–5322).
std::vector<DoseGoal> default_dose_goals();

}  // namespace brachy
