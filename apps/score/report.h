#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/score/exercise.h"
#include "apps/score/score.h"
#include "apps/session/session_folder.h"
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

/// Scores the recording in `folder`, or the implant of a file of seeds, against `plan`, the one at its start, in
/// `scene`: where the plan was changed while it ran (apps/session/plan_change_log.h), seeds of later needles are in no
/// plan, and a remark says so. A file of seeds may have an empty plan: then only its dose is known.
/// `progress` as score_session. Throws UserError as load_recording and score_session do.
Score score_recording(const std::filesystem::path& folder, const Plan& plan, const Scene& scene,
                      const std::vector<Structure>& structures,
                      const std::function<void(double share)>& progress = {});

/// What a report has that neither the session nor its scene says.
struct ReportOptions {
  std::vector<std::string> remarks;    ///< before the score's own
  std::optional<Exercise> exercise{};  ///< of a session whose manifest knows none
};

/// Whose session it was, and whether it passes its exercise, into a score that is complete but for that.
void add_session(const SessionFolder& folder, const ReportOptions& options, Score& score);

/// A score, and its page and JSON as files.
struct Report {
  Score score;
  std::string html, json;
};

/// The same, with the scene's structures, as a report.
Report make_report(const std::filesystem::path& folder, const Plan& plan, const Scene& scene,
                   const std::function<void(double share)>& progress = {}, const ReportOptions& options = {});

/// What becomes of another report that a session's directory has already: it is refused, or replaced.
enum class EarlierReport { kRefused, kReplaced };

/// Writes the files of a report, by their names, into a session's directory: all of them, or none where one is refused.
/// Throws UserError where that cannot be done.
void keep_report(const SessionFolder& folder,
                 const std::vector<std::pair<const char*, const std::string&>>& files, EarlierReport earlier);
/// report.html and report.json.
void keep_report(const SessionFolder& folder, const Report& report, EarlierReport earlier);

}  // namespace brachy
