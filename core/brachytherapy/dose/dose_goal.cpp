#include "core/brachytherapy/dose/dose_goal.h"

#include <algorithm>
#include <array>
#include <limits>

namespace brachy {
namespace {

using enum DoseIndex::Unit;

constexpr std::array kIndices = {DoseIndex{"V100", &StructureDose::v100_percent, kPercent},
                                 DoseIndex{"V150", &StructureDose::v150_percent, kPercent},
                                 DoseIndex{"V200", &StructureDose::v200_percent, kPercent},
                                 DoseIndex{"V100cc", &StructureDose::v100_cc, kCc},
                                 DoseIndex{"D90", &StructureDose::d90_gy, kGy},
                                 DoseIndex{"D30", &StructureDose::d30_gy, kGy},
                                 DoseIndex{"D10", &StructureDose::d10_gy, kGy},
                                 DoseIndex{"D5", &StructureDose::d5_gy, kGy},
                                 DoseIndex{"D2cc", &StructureDose::d2cc_gy, kGy},
                                 DoseIndex{"D0.1cc", &StructureDose::d0_1cc_gy, kGy}};

constexpr const char *kAbs = "ABS 2012", *kEstro = "GEC-ESTRO 2007", *kTg137 = "AAPM TG-137",
                     *kBoth = "GEC-ESTRO 2007, AAPM TG-137";

}  // namespace

std::span<const DoseIndex> dose_indices() {
  return kIndices;
}

const DoseIndex* find_dose_index(std::string_view name) {
  const auto found =
      std::ranges::find(kIndices, name, [](const DoseIndex& i) { return std::string_view(i.name); });
  return found == kIndices.end() ? nullptr : &*found;
}

const char* unit_text(DoseIndex::Unit unit) {
  return unit == kPercent ? "%" : unit == kCc ? "cm³" : "Gy";
}

double DoseGoal::limit_for(double prescription_gy) const {
  const DoseIndex* index = find_dose_index(figure);
  return index && index->unit == kGy ? limit / 100 * prescription_gy : limit;
}

double DoseGoal::value_in(std::span<const StructureDose> doses) const {
  const auto found = std::ranges::find(doses, structure, &StructureDose::name);
  const DoseIndex* index = find_dose_index(figure);
  return found != doses.end() && index ? (*found).*index->value : std::numeric_limits<double>::quiet_NaN();
}

bool DoseGoal::is_met_by(double value, double prescription_gy) const {
  const double bound = limit_for(prescription_gy);
  return is_above() ? value >= bound : value < bound;
}

// core/brachytherapy/dose/README.md says which of them were checked. D0.1cc of the rectum: 200 Gy of 145. Of an implant
// the limits are those at which it is called adequate.
std::vector<DoseGoal> default_dose_goals() {
  return {{"prostate", "V100", "plan", "above", 95, kBoth},
          {"prostate", "D90", "plan", "above", 100, kBoth},
          {"prostate", "V150", "plan", "below", 60, kAbs},
          {"urethra", "D5", "plan", "below", 150, kAbs},
          {"urethra", "D10", "plan", "below", 150, kBoth},
          {"urethra", "D30", "plan", "below", 125, kAbs},
          {"rectum", "D2cc", "plan", "below", 100, kBoth},
          {"rectum", "D0.1cc", "plan", "below", 200.0 / 1.45, kEstro},
          {"rectum", "V100cc", "plan", "below", 1, kAbs},
          {"prostate", "V100", "implant", "above", 90, kAbs},
          {"prostate", "D90", "implant", "above", 90, kAbs},
          {"prostate", "V150", "implant", "below", 70, "no source found"},
          {"urethra", "D10", "implant", "below", 150, kBoth},
          {"urethra", "D30", "implant", "below", 125, kAbs},
          {"rectum", "D2cc", "implant", "below", 100, kTg137},
          {"rectum", "D0.1cc", "implant", "below", 200.0 / 1.45, kBoth},
          {"rectum", "V100cc", "implant", "below", 1, kAbs}};
}

}  // namespace brachy
