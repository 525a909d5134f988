#include "apps/score/hdr_report.h"

#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/score/recording.h"
#include "core/base/error.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/hdr/dwell_doses.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

/// One figure of a fraction: percent of the volume, or of the prescription where `is_dose`.
struct HdrFigure {
  const char *structure, *name, *key;
  double StructureDose::*value;
  bool is_dose;
  double goal;  ///< 0: none
  bool is_least = false;
};

constexpr HdrFigure kHdrFigures[] = {
    {"prostate", "V100", "v100_percent", &StructureDose::v100_percent, false, HdrGoals::kLeastV100, true},
    {"prostate", "V150", "v150_percent", &StructureDose::v150_percent, false, HdrGoals::kMostV150},
    {"prostate", "V200", "v200_percent", &StructureDose::v200_percent, false, 0},
    {"prostate", "D90", "d90_percent", &StructureDose::d90_gy, true, 0},
    {"urethra", "D10", "d10_percent", &StructureDose::d10_gy, true, HdrGoals::kMostUrethraD10},
    {"urethra", "D0.1cc", "d0_1cc_percent", &StructureDose::d0_1cc_gy, true, 0},
    {"rectum", "D2cc", "d2cc_percent", &StructureDose::d2cc_gy, true, HdrGoals::kMostD2cc},
    {"bladder", "D2cc", "d2cc_percent", &StructureDose::d2cc_gy, true, HdrGoals::kMostD2cc},
};

// NaN where there is no such structure.
double value_of(const std::vector<StructureDose>& doses, const HdrFigure& f, double prescription_gy) {
  for (const StructureDose& d : doses)
    if (d.name == f.structure) return d.*f.value * (f.is_dose ? 100 / prescription_gy : 1);
  return NAN;
}

bool is_met(const HdrFigure& f, double value) {
  return f.goal == 0 || (f.is_least ? value >= f.goal : value <= f.goal);
}

nlohmann::ordered_json figures_json(const std::vector<StructureDose>& doses, double prescription_gy) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const HdrFigure& f : kHdrFigures) {
    const double value = value_of(doses, f, prescription_gy);
    if (!std::isfinite(value)) continue;
    nlohmann::ordered_json& figure = json[f.structure][f.key];
    figure = {{"value", value}};
    if (f.goal != 0) {
      figure[f.is_least ? "least" : "most"] = f.goal;
      figure["met"] = is_met(f, value);
    }
  }
  return json;
}

// Straight catheters along the last poses.
std::vector<CatheterCourse> catheters_of_poses(const Recording& recording, const Scene& scene) {
  std::vector<CatheterCourse> all;
  for (const NeedleTrajectories::Needle& needle : recording.poses->needles()) {
    if (needle.id >= scene.needle.count) continue;
    const RigidTransform X_WN = *recording.poses->sample(needle.id, recording.poses->end_s());
    CatheterCourse course{needle.id, {}, {}};
    for (double s = 0; s <= scene.needle.length_mm; s += CatheterCourse::kStepMm) {
      const Vec3 p = X_WN.p - s * X_WN.R.col(2);
      if (p.z() < scene.template_grid.origin_mm.z() && course.now.size() >= 2) break;
      course.now.push_back(p);
    }
    course.rest = course.now;
    // One that is out again is no catheter.
    if (course.now.front().z() > scene.template_grid.origin_mm.z()) all.push_back(std::move(course));
  }
  return all;
}

std::vector<CatheterCourse> catheters_in(const std::filesystem::path& folder, const Scene& scene) {
  const std::filesystem::path file = folder / kCatheterFile;
  if (const auto text = SessionFolder::open(folder).read(kCatheterFile))
    return parse_catheters(*text, file.string());
  const Recording recording = load_recording(folder);
  if (!recording.poses)
    throw UserError(folder.string() + ": has neither " + kCatheterFile +
                    " nor poses.csv; score another session");
  std::cerr << "brachy: " << file.string()
            << " is missing; catheters are taken as straight, and the tissue as at rest: "
            << "`brachy replay " << (folder / "poses.csv").string()
            << " --offline --session DIR` computes both\n";
  return catheters_of_poses(recording, scene);
}

}  // namespace

std::string hdr_dose_text(const std::vector<HdrDoseColumn>& columns, double prescription_gy) {
  std::string text = fmt::format("  {:<22}", "% of volume or dose");
  for (const HdrDoseColumn& c : columns) text += fmt::format("{:>14}", c.heading);
  text += "   goal\n";
  for (const HdrFigure& f : kHdrFigures) {
    if (!std::isfinite(value_of(*columns.front().doses, f, prescription_gy))) continue;
    text += fmt::format("  {:<22}", fmt::format("{} {}", f.structure, f.name));
    for (const HdrDoseColumn& c : columns) {
      const double value = value_of(*c.doses, f, prescription_gy);
      text += std::isfinite(value) ? fmt::format("{:>13.1f}{}", value, is_met(f, value) ? ' ' : '!')
                                   : fmt::format("{:>13} ", "-");
    }
    text += f.goal == 0 ? "\n" : fmt::format("   {} {:g}\n", f.is_least ? "≥" : "≤", f.goal);
  }
  return text;
}

std::string hdr_dose_json(const std::vector<StructureDose>& doses, double prescription_gy) {
  return figures_json(doses, prescription_gy).dump();
}

std::string to_text(const HdrScore& score, const HdrPlan& plan) {
  std::string text =
      fmt::format("catheters of plan \"{}\", mm:\n  {:<6}{:>8}{:>12}{:>13}{:>14}{:>10}\n", plan.name, "hole",
                  "needle", "tip along", "tip across", "dwells, mean", "largest");
  for (const CatheterScore& c : score.catheters)
    text += c.needle ? fmt::format("  {:<6}{:>8}{:>12.2f}{:>13.2f}{:>14.2f}{:>10.2f}\n",
                                   plan.catheters[c.planned].label(), *c.needle, c.along_mm, c.across_mm,
                                   c.mean_mm, c.largest_mm)
                     : fmt::format("  {:<6}{:>8}\n", plan.catheters[c.planned].label(), "none");
  for (const std::uint32_t needle : score.unplanned)
    text += fmt::format("  needle {} is in no planned hole\n", needle);
  for (std::size_t i = 0; i < score.findings.size(); ++i)
    text += fmt::format("{}. {}\n", i + 1, score.findings[i].text);
  text += fmt::format("dose of the fraction, {:g} Gy:\n", score.prescription_gy);
  return text +
         hdr_dose_text(
             {{"plan", &score.plan}, {"delivered", &score.delivered}, {"reoptimised", &score.reoptimised}},
             score.prescription_gy);
}

std::string to_json(const HdrScore& score, const HdrPlan& plan) {
  nlohmann::ordered_json json = {{"plan", plan.name}, {"prescription_gy", score.prescription_gy}};
  json["catheters"] = nlohmann::ordered_json::array();
  for (const CatheterScore& c : score.catheters) {
    nlohmann::ordered_json one = {{"hole", plan.catheters[c.planned].label()}};
    one["needle"] = c.needle ? nlohmann::ordered_json(*c.needle) : nlohmann::ordered_json(nullptr);
    if (c.needle) {
      one["tip_error_mm"] = {c.tip_error.x(), c.tip_error.y(), c.tip_error.z()};
      one["dwells_mean_mm"] = c.mean_mm;
      one["dwells_largest_mm"] = c.largest_mm;
    }
    one["reoptimised_s"] = score.reoptimised_plan.catheters[c.planned].dwell_s;
    json["catheters"].push_back(std::move(one));
  }
  json["unplanned_needles"] = score.unplanned;
  json["findings"] = nlohmann::ordered_json::array();
  for (const Finding& f : score.findings) {
    nlohmann::ordered_json one = {{"text", f.text}, {"cause", f.cause}, {"catheters", f.needles}};
    one["cost"] = nullptr;
    if (f.cost)
      one["cost"] = {{"v100_percent", f.cost->v100_percent},
                     {"d90_gy", f.cost->d90_gy},
                     {"urethra_d30_gy", f.cost->urethra_d30_gy},
                     {"rectum_d2cc_gy", f.cost->rectum_d2cc_gy}};
    json["findings"].push_back(std::move(one));
  }
  json["dose"] = {{"plan", figures_json(score.plan, score.prescription_gy)},
                  {"delivered", figures_json(score.delivered, score.prescription_gy)},
                  {"reoptimised", figures_json(score.reoptimised, score.prescription_gy)}};
  return json.dump();
}

Score as_score(const HdrScore& hdr) {
  Score score;
  score.dose.prescription_gy = hdr.prescription_gy;
  score.dose.plan.structures = hdr.plan;
  score.dose.rest.structures = hdr.delivered;
  score.findings = hdr.findings;
  std::vector<DoseGoal> goals;
  for (const HdrFigure& f : kHdrFigures)
    if (f.goal != 0)
      goals.push_back({.structure = f.structure,
                       .figure = f.name,
                       .stage = "implant",
                       .side = f.is_least ? "above" : "below",
                       .limit = f.goal});
  score.goals = judge(goals, score.dose);
  return score;
}

std::string score_catheters(const std::filesystem::path& folder, const Scene& scene, bool json,
                            const HdrPlan* plan, EarlierReport earlier, HdrScore* scored) {
  const std::optional<HdrPlan> of_scene = plan ? std::nullopt : load_hdr_plan(scene);
  if (!plan && !of_scene) return {};
  const HdrPlan& against = plan ? *plan : *of_scene;
  const HdrScore score = score_hdr(against, scene.template_grid, load_structures(scene), scene.dose,
                                   catheters_in(folder, scene));
  if (scored) *scored = score;
  const SessionFolder session = SessionFolder::make(folder);
  keep_report(session, kHdrReportFile, to_json(score, against) + "\n", earlier);
  const std::filesystem::path file = session.path_of(kHdrReportFile);
  return json ? to_json(score, against) + "\n" : to_text(score, against) + file.string() + "\n";
}

}  // namespace brachy
