#pragma once

#include <filesystem>
#include <span>
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

/// A fraction's session against its plan, and its page and JSON as files.
struct FractionReport {
  HdrPlan plan;
  HdrScore fraction;
  /// The same as pages, exercises and histories of implants have it: doses of the plan and as delivered, goals,
  /// findings, catheters, needles, organs.
  Score score;
  std::string html, json;  ///< report.html, hdr_report.json
};

/// Scores the session in `folder` against `plan` in `scene`. Without kCatheterFile the catheters lie straight along the
/// last poses of poses.csv, in tissue at rest, and a remark says so. Throws UserError,
/// also where the folder has neither file. Some seconds.
FractionReport make_fraction_report(const std::filesystem::path& folder, const HdrPlan& plan,
                                    const Scene& scene, const ReportOptions& options = {});

/// A few lines for a terminal.
std::string to_text(const FractionReport& report);

/// The page of a fraction, as to_html(Score): of the same style, and it prints on A4.
std::string to_html(const FractionReport& report, const TemplateGrid& grid);

/// report.html and hdr_report.json.
void keep_report(const SessionFolder& folder, const FractionReport& report, EarlierReport earlier);

/// One figure of a fraction: percent of the volume, or of the prescription where `is_dose`.
struct HdrFigure {
  const char *structure, *name, *key;
  double StructureDose::*value;
  bool is_dose;
  double goal;  ///< 0: none
  bool is_least = false;

  bool is_met_by(double percent) const { return goal == 0 || (is_least ? percent >= goal : percent <= goal); }
  /// NaN where there is no such structure.
  double of(const std::vector<StructureDose>& doses, double prescription_gy) const;
};
/// In the order of reports.
std::span<const HdrFigure> hdr_figures();

}  // namespace brachy
