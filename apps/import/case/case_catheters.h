#pragma once

#include <string>
#include <vector>

#include "apps/import/case/case_plan.h"
#include "apps/import/case/imported_case.h"

namespace brachy {

/// The TG-43 data for a source of high or pulsed dose rate: of the model that the file names; else, for Ir-192, of one
/// with its active length. `wanted`: its name among the shipped ones, or empty.
struct TemporarySource {
  SourceModel model;
  bool is_assumed;  ///< neither the file nor `wanted` names it
};
/// Errors: UserError "name: …; fix" where no data are known.
TemporarySource temporary_source_of(const RtSource& source, const std::string& wanted,
                                    const std::string& name);

/// A fraction of any planning system: each channel with dwells is a catheter along its dwell positions, from the tip
/// backwards. Beyond these it runs as the structure of the set that is its applicator (of `courses`, by number or by
/// where it lies; those are taken out), else straight. The tip is the end that lies deeper in the patient (+z, as
/// needles through the perineum go); of a catheter across the patient the end from which relative positions count.
/// Notes say how far dwells lie beside their structures, and what was assumed. `wanted`: as above.
/// Errors: UserError as dwells_of and temporary_source_of; where no dwell has a time, or strength, times, catheters
/// or dwells are more than a plan may have.
CasePlan catheters_of(const RtBrachyPlan& file, std::vector<ImportedCourse>& courses,
                      const std::string& wanted, const std::string& name);

}  // namespace brachy
