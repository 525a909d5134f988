#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "apps/score/score.h"
#include "core/scene/scene.h"

namespace brachy {

inline constexpr const char* kNotice = "For training and research. Not a medical device.";

/// The report as one HTML page that needs no other file and runs no script; prints on A4. Charts are SVG within it.
/// `plan`, `grid` and `structures` are those that were scored with.
std::string to_html(const Score& score, const Plan& plan, const TemplateGrid& grid,
                    const std::vector<Structure>& structures);

/// The same as a JSON object on one line; unknown values are null. DVHs are shares of each structure's volume that
/// receive at least k % of the prescription, k = 0 … 300.
std::string to_json(const Score& score);

/// A few lines for a terminal.
std::string to_text(const Score& score);

/// Scores the recording in `folder` against `plan`, the one at its start, in `scene`: where the plan was changed
/// while it ran (apps/session/plan_change_log.h), seeds of later needles are in no plan, and a remark says so.
/// `progress` as score_session. Throws UserError as load_recording and score_session do.
Score score_recording(const std::filesystem::path& folder, const Plan& plan, const Scene& scene,
                      const std::vector<Structure>& structures,
                      const std::function<void(double share)>& progress = {});

/// The same, with the scene's structures, and writes `html` and, beside it with the ending .json,
/// the JSON; an existing file is replaced. Throws UserError also where the files cannot be written.
Score write_report(const std::filesystem::path& folder, const Plan& plan, const Scene& scene,
                   const std::filesystem::path& html, const std::function<void(double share)>& progress = {});

}  // namespace brachy
