#include "apps/score/hdr_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "apps/score/recording.h"
#include "core/base/error.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/hdr/dwell_doses.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

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

nlohmann::ordered_json figures_json(const std::vector<StructureDose>& doses, double prescription_gy) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const HdrFigure& f : kHdrFigures) {
    const double value = f.of(doses, prescription_gy);
    if (!std::isfinite(value)) continue;
    nlohmann::ordered_json& figure = json[f.structure][f.key];
    figure = {{"value", value}};
    if (f.goal != 0) {
      figure[f.is_least ? "least" : "most"] = f.goal;
      figure["met"] = f.is_met_by(value);
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

/// What lies in the patient; a remark says where it is not known how.
std::vector<CatheterCourse> catheters_in(const SessionFolder& folder, const Scene& scene,
                                         const std::optional<Recording>& recording,
                                         std::vector<std::string>& remarks) {
  const std::filesystem::path file = folder.path_of(kCatheterFile);
  if (const auto text = folder.read(kCatheterFile)) return parse_catheters(*text, file.string());
  if (!recording || !recording->poses)
    throw UserError(folder.path().string() + ": has neither " + kCatheterFile +
                    " nor poses.csv; score another session");
  remarks.push_back(
      fmt::format("{} is missing: catheters are taken as straight, and the tissue as at rest. `brachy replay "
                  "{} --offline "
                  "--session DIR` computes both.",
                  kCatheterFile, folder.path_of(kPosesFile).string()));
  return catheters_of_poses(*recording, scene);
}

CathetersScore summed(const HdrScore& fraction) {
  CathetersScore all{.unplanned = fraction.unplanned.size()};
  double sum_mm = 0;
  for (const CatheterScore& c : fraction.catheters) {
    if (!c.needle) {
      ++all.missing;
      continue;
    }
    ++all.placed;
    sum_mm += c.mean_mm;
    all.largest_mm = std::fmax(all.largest_mm, c.largest_mm);
    all.depth_mm = std::fmax(all.depth_mm, std::abs(c.along_mm));
  }
  if (all.placed > 0) all.mean_mm = sum_mm / static_cast<double>(all.placed);
  return all;
}

/// Holes of the catheters that go through one.
std::vector<std::string> straight_holes(const HdrPlan& plan) {
  std::vector<std::string> holes = holes_of(plan.catheters);
  std::erase(holes, std::string());
  return holes;
}

/// What `recording` tells of needles and organs, which a fraction has like an implant.
void score_motion(const Recording& recording, const HdrPlan& plan, const Scene& scene,
                  const std::vector<Structure>& structures, Score& score) {
  const NeedleTrajectories* poses = recording.poses ? &*recording.poses : nullptr;
  const SurfaceBvh gland(structures.front().mesh);
  score.needles = score_needles(straight_holes(plan), scene.template_grid, poses, recording.forces,
                                [&](const Vec3& p) { return gland.inside(p); });
  const auto organs = std::span(structures).subspan(1);
  if (recording.passes)
    score.contacts = structure_contacts(organs, scene.template_grid, *recording.passes, poses);
  else if (poses)
    score.contacts = structure_contacts(organs, scene.template_grid, *poses);
}

std::string to_json(const FractionReport& report) {
  const HdrScore& fraction = report.fraction;
  nlohmann::ordered_json json = {{"plan", report.plan.name}, {"prescription_gy", fraction.prescription_gy}};
  json["catheters"] = nlohmann::ordered_json::array();
  for (const CatheterScore& c : fraction.catheters) {
    nlohmann::ordered_json one = {{"hole", report.plan.catheters[c.planned].label()}};
    one["needle"] = c.needle ? nlohmann::ordered_json(*c.needle) : nlohmann::ordered_json(nullptr);
    if (c.needle) {
      one["tip_error_mm"] = {c.tip_error.x(), c.tip_error.y(), c.tip_error.z()};
      one["dwells_mean_mm"] = c.mean_mm;
      one["dwells_largest_mm"] = c.largest_mm;
    }
    for (std::size_t s = 0; s < c.mean_gy.size(); ++s)
      if (std::isfinite(c.mean_gy[s])) one["mean_gy"][fraction.delivered[s].name] = c.mean_gy[s];
    one["reoptimised_s"] = fraction.reoptimised_plan.catheters[c.planned].dwell_s;
    json["catheters"].push_back(std::move(one));
  }
  json["unplanned_needles"] = fraction.unplanned;
  // What an implant's report has, too, is written as there.
  const auto shared = nlohmann::ordered_json::parse(to_json(report.score));
  json["findings"] = nlohmann::ordered_json::array();
  for (const auto& f : shared.at("findings"))
    json["findings"].push_back({{"text", f.at("text")},
                                {"at_s", f.at("at_s")},
                                {"cause", f.at("cause")},
                                {"catheters", f.at("needles")},
                                {"cost", f.at("cost")}});
  json["dose"] = {{"plan", figures_json(fraction.plan, fraction.prescription_gy)},
                  {"delivered", figures_json(fraction.delivered, fraction.prescription_gy)},
                  {"reoptimised", figures_json(fraction.reoptimised, fraction.prescription_gy)}};
  for (const StructureDose& d : fraction.delivered)
    if (std::isfinite(d.mean_gy)) json["dose"]["delivered_mean_gy"][d.name] = d.mean_gy;
  for (const char* key :
       {"notice", "recording", "about", "exercise", "remarks", "verdict", "structures_entered", "needles"})
    json[key] = shared.at(key);
  return json.dump();
}

}  // namespace

std::string hdr_dose_text(const std::vector<HdrDoseColumn>& columns, double prescription_gy) {
  std::string text = fmt::format("  {:<22}", "% of volume or dose");
  for (const HdrDoseColumn& c : columns) text += fmt::format("{:>14}", c.heading);
  text += "   goal\n";
  for (const HdrFigure& f : kHdrFigures) {
    if (!std::isfinite(f.of(*columns.front().doses, prescription_gy))) continue;
    text += fmt::format("  {:<22}", fmt::format("{} {}", f.structure, f.name));
    for (const HdrDoseColumn& c : columns) {
      const double value = f.of(*c.doses, prescription_gy);
      text += std::isfinite(value) ? fmt::format("{:>13.1f}{}", value, f.is_met_by(value) ? ' ' : '!')
                                   : fmt::format("{:>13} ", "-");
    }
    text += f.goal == 0 ? "\n" : fmt::format("   {} {:g}\n", f.is_least ? "≥" : "≤", f.goal);
  }
  return text;
}

std::string hdr_dose_json(const std::vector<StructureDose>& doses, double prescription_gy) {
  return figures_json(doses, prescription_gy).dump();
}

std::span<const HdrFigure> hdr_figures() {
  return kHdrFigures;
}

double HdrFigure::of(const std::vector<StructureDose>& doses, double prescription_gy) const {
  for (const StructureDose& d : doses)
    if (d.name == structure) return d.*value * (is_dose ? 100 / prescription_gy : 1);
  return NAN;
}

std::string to_text(const FractionReport& report) {
  const HdrScore& fraction = report.fraction;
  const Score& score = report.score;
  std::string text = fmt::format(
      "catheters of plan \"{}\", mm:\n  {:<6}{:>8}{:>12}{:>13}{:>14}{:>10}{:>11}\n", report.plan.name, "hole",
      "needle", "tip along", "tip across", "dwells, mean", "largest", "gland, Gy");
  for (const CatheterScore& c : fraction.catheters) {
    const std::string& label = report.plan.catheters[c.planned].label();
    text += c.needle ? fmt::format("  {:<6}{:>8}{:>12.2f}{:>13.2f}{:>14.2f}{:>10.2f}{:>11.2f}\n", label,
                                   *c.needle, c.along_mm, c.across_mm, c.mean_mm, c.largest_mm,
                                   c.mean_gy.empty() ? NAN : c.mean_gy.front())
                     : fmt::format("  {:<6}{:>8}\n", label, "none");
  }
  for (const std::uint32_t needle : fraction.unplanned)
    text += fmt::format("  needle {} is in no planned hole\n", needle);
  for (std::size_t i = 0; i < score.findings.size(); ++i)
    text += fmt::format("{}. {}\n", i + 1, score.findings[i].text);
  text += fmt::format("dose of the fraction, {:g} Gy:\n", fraction.prescription_gy);
  return text +
         hdr_dose_text({{"plan", &fraction.plan},
                        {"delivered", &fraction.delivered},
                        {"reoptimised", &fraction.reoptimised}},
                       fraction.prescription_gy) +
         "verdict: " + verdict(score.goals) + "\n";
}

FractionReport make_fraction_report(const std::filesystem::path& folder, const HdrPlan& plan,
                                    const Scene& scene, const ReportOptions& options) {
  const SessionFolder session = SessionFolder::open(folder);
  std::optional<Recording> recording;
  // catheters.csv alone is enough for the dose.
  if (session.has(kPosesFile) || !session.has(kCatheterFile)) recording = load_recording(folder);
  if (recording && scene.probe.on) leave_out(*recording, static_cast<std::uint32_t>(scene.needle.count));
  const std::vector<Structure> structures = load_structures(scene);

  FractionReport report{.plan = plan, .fraction = {}, .score = {}, .html = {}, .json = {}};
  Score& score = report.score;
  score.recording = recording ? recording->name : folder.filename().string();
  score.plan = plan.name;
  if (recording) std::ranges::copy(recording->remarks, std::back_inserter(score.remarks));
  report.fraction = score_hdr(plan, scene.template_grid, structures, scene.dose,
                              catheters_in(session, scene, recording, score.remarks));
  const HdrScore& fraction = report.fraction;
  score.dose.prescription_gy = fraction.prescription_gy;
  score.dose.margin_mm = scene.dose.margin_mm;
  score.dose.plan.structures = fraction.plan;
  score.dose.rest.structures = fraction.delivered;
  score.goals = judge(scene.goals.empty() ? hdr_dose_goals() : scene.goals, score.dose);
  score.catheters = summed(fraction);
  score.slices = fraction.slices;
  if (recording) score_motion(*recording, plan, scene, structures, score);
  score.findings = organ_findings(score.contacts);
  for (const auto& more :
       {fraction.findings, hasty_findings(score.needles), missed_goal_findings(score.goals, score.dose)})
    score.findings.insert(score.findings.end(), more.begin(), more.end());
  add_session(session, options, score);
  report.html = to_html(report, scene.template_grid);
  report.json = to_json(report) + "\n";
  return report;
}

void keep_report(const SessionFolder& folder, const FractionReport& report, EarlierReport earlier) {
  keep_report(folder, {{kReportPage, report.html}, {kHdrReportFile, report.json}}, earlier);
}

}  // namespace brachy
