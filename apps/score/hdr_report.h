#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/score/hdr_score.h"
#include "apps/score/report.h"
#include "apps/score/score.h"
#include "core/scene/scene.h"

namespace brachy {

/// The figures of a fraction against their goals (HdrGoals), structure by structure; percent of the prescription where
/// a dose. Structures that the scene has not are left out. `columns`: a heading and the doses of each.
struct HdrDoseColumn {
  const char* heading;
  const std::vector<StructureDose>* doses;
};
std::string hdr_dose_text(const std::vector<HdrDoseColumn>& columns, double prescription_gy);
/// The same as a JSON object {"prostate": {"v100_percent": …}, …}.
std::string hdr_dose_json(const std::vector<StructureDose>& doses, double prescription_gy);

std::string to_text(const HdrScore& score, const HdrPlan& plan);
std::string to_json(const HdrScore& score, const HdrPlan& plan);  ///< one line

/// An HDR score as exercises judge one: doses of the plan and as delivered, and findings; what only seeds have is not
/// known, and keeps no bound.
Score as_score(const HdrScore& score);

/// Scores the session in `folder` against `plan`, or the scene's, writes hdr_report.json there (keep_report), and
/// returns the report, or its JSON; empty where there is no plan of HDR. Without kCatheterFile the catheters lie
/// straight along the last poses of poses.csv, in tissue at rest, and standard error says so. Errors: UserError, also
/// where the folder has neither file. `scored`, if any, gets the score.
std::string score_catheters(const std::filesystem::path& folder, const Scene& scene, bool json,
                            const HdrPlan* plan = nullptr, EarlierReport earlier = EarlierReport::kRefused,
                            HdrScore* scored = nullptr);

}  // namespace brachy
