#pragma once

#include <vector>

#include "apps/score/findings.h"
#include "apps/score/hdr_score.h"
#include "core/brachytherapy/dose/implant_dose.h"

namespace brachy {

/// What went wrong in a session of HDR, as find_mistakes has it for seeds: catheters that lie aside, deeper or
/// shallower than planned, alone, in groups or all of them, that are missing or nobody's, and what the tissue did
/// from where they lie now to where it rests. Each costs what the planned times give there, against the same without
/// it. Of each cause `needles` are indices of HdrPlan::catheters, and `seeds` are empty. `courses`: each planned
/// catheter's, null: none.
std::vector<Finding> find_hdr_mistakes(const HdrPlan& plan, const TemplateGrid& grid,
                                       const std::vector<const CatheterCourse*>& courses,
                                       const std::vector<std::uint32_t>& unplanned,
                                       const std::vector<Structure>& structures, const DoseSettings& dose);

}  // namespace brachy
