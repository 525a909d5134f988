#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/score/hdr_score.h"
#include "core/scene/scene.h"

namespace brachy {

/// Of a session's directory: where its catheters lie at its end (core/brachytherapy/hdr/catheter_course.h).
inline constexpr const char* kCatheterFile = "catheters.csv";

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

/// Scores the session in `folder` against `plan`, or the scene's, writes hdr_report.json there, and returns the
/// report, or its JSON; empty where there is no plan of HDR. Without kCatheterFile the catheters lie straight along
/// the last poses of poses.csv, in tissue at rest, and standard error says so. Errors: UserError, also where the
/// folder has neither file.
std::string score_catheters(const std::filesystem::path& folder, const Scene& scene, bool json,
                            const HdrPlan* plan = nullptr);

}  // namespace brachy
