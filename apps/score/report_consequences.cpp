#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/charts/svg_chart.h"
#include "apps/score/report_figures.h"
#include "apps/score/report_sections.h"

namespace brachy {
namespace {

/// A figure that rounds to zero has no sign.
std::string signed_figure(double value, int digits) {
  if (!std::isfinite(value)) return "–";
  const bool is_zero = std::abs(value) < 0.5 * std::pow(10, -digits);
  return is_zero ? fmt::format("{:.{}f}", 0.0, digits) : fmt::format("{:+.{}f}", value, digits);
}

/// In whole mm; not "-0".
std::string place(const Vec3& at) {
  const auto whole = [](double mm) { return std::lround(mm); };
  return fmt::format("({}, {}, {})", whole(at.x()), whole(at.y()), whole(at.z()));
}

std::string cells(const DoseChange& c) {
  return fmt::format("<td>{}</td><td>{}</td><td>{}</td><td>{}</td>", signed_figure(c.v100_percent, 1),
                     signed_figure(c.d90_gy, 1), signed_figure(c.urethra_d30_gy, 1),
                     signed_figure(c.rectum_d2cc_gy, 1));
}

constexpr std::size_t kMostNeedles = 8;

// The costliest first.
std::string needle_costs(const Score& score, const Plan& plan) {
  std::vector<NeedleCost> needles = score.consequences->needles;
  const double gy = score.dose.prescription_gy;
  std::ranges::stable_sort(needles, std::greater(),
                           [&](const NeedleCost& n) { return n.change.harm_percent(gy); });
  std::string rows = "<tr><td>all, against the plan</td>" + cells(score.consequences->whole) + "</tr>\n";
  for (std::size_t i = 0; i < std::min(needles.size(), kMostNeedles); ++i)
    rows += fmt::format("<tr><td>{}</td>{}</tr>\n", xml_escaped(plan.needles[needles[i].needle].hole),
                        cells(needles[i].change));
  return "<table>\n<thead><tr><th>needle</th><th>V100,<br>%</th><th>D90,<br>Gy</th><th>urethra<br>D30, "
         "Gy</th>"
         "<th>rectum<br>D2cc, Gy</th></tr></thead>\n<tbody>\n" +
         rows + "</tbody>\n</table>\n";
}

std::string sectors(const Score& score) {
  std::string rows;
  for (const Sector& sector : score.consequences->sectors)
    rows += fmt::format("<tr><td>{}</td><td{}>{:.2f}</td><td>{:.0f}</td><td>{}</td></tr>\n", sector.name,
                        sector.cold_cc > 0.1 * sector.volume_cc ? " class=\"missed\"" : "", sector.cold_cc,
                        sector.coldest_gy, place(sector.coldest));
  std::string out =
      "<table>\n<thead><tr><th>sector</th><th>cold,<br>cm³</th><th>coldest,<br>Gy</th><th>at, mm</th>"
      "</tr></thead>\n<tbody>\n" +
      rows + "</tbody>\n</table>\n";
  if (const auto& hot = score.consequences->urethra)
    out += fmt::format(
        "<p class=\"small\">Hottest place of the urethra: {:.0f} Gy at {} mm; {:.2f} "
        "cm³ of it over 150 %.</p>\n",
        hot->gy, place(hot->at), hot->over_150_cc);
  return out;
}

std::string organs(const Score& score) {
  if (score.contacts.empty()) return "<p>Organs entered: none.</p>\n";
  std::string out = "<p>Organs entered: ";
  for (std::size_t i = 0; i < score.contacts.size(); ++i) {
    const StructureContact& c = score.contacts[i];
    out +=
        fmt::format("{}{} {} × through {}, {:.1f} mm deep, {:.1f} s", i ? "; " : "", xml_escaped(c.structure),
                    c.passes, c.hole.empty() ? "no hole" : xml_escaped(c.hole), c.depth_mm, c.time_s);
  }
  return out + ".</p>\n";
}

std::string failed_drops(const Score& score) {
  if (!score.failed_drops || score.failed_drops->empty()) return "";
  std::map<DropRefusal, std::size_t> counts;
  for (const FailedDrop& drop : *score.failed_drops) ++counts[drop.why];
  std::string out = "<p>Seeds asked for that are not in the body: ";
  for (bool is_first = true; const auto& [why, count] : counts) {
    out += fmt::format("{}{} × {}", is_first ? "" : "; ", count, xml_escaped(std::string(to_string(why))));
    is_first = false;
  }
  return out + ".</p>\n";
}

std::string goal_rows(const Score& score, bool of_plan) {
  std::string rows;
  for (const GoalResult& result : score.goals) {
    if (result.goal.is_of_plan() != of_plan) continue;
    const DoseIndex* index = find_dose_index(result.goal.figure);
    if (!index) continue;
    rows +=
        fmt::format("<tr><td>{} {}</td><td{}>{}</td><td>{} {:.4g} {}</td><td class=\"left\">{}</td></tr>\n",
                    xml_escaped(result.goal.structure), result.goal.figure,
                    result.is_met.value_or(true) ? "" : " class=\"missed\"",
                    figure(result.value, index->unit == DoseIndex::Unit::kCc ? 2 : 1),
                    result.goal.is_above() ? "≥" : "&lt;", result.limit, unit_text(index->unit),
                    xml_escaped(result.goal.source));
  }
  return rows;
}

std::string goal_table(const char* title, const std::string& rows) {
  return fmt::format(
      "<div><table class=\"goals\">\n<thead><tr><th>{}</th><th>is</th><th>goal</th><th "
      "class=\"left\">source</th></tr>"
      "</thead>\n<tbody>\n{}</tbody>\n</table></div>\n",
      title, rows);
}

}  // namespace

std::string goals_section(const Score& score) {
  if (score.goals.empty()) return "";
  return fmt::format("<h2>Goals</h2>\n<p class=\"verdict\">{}.</p>\n<div class=\"pair\">\n",
                     xml_escaped(verdict(score.goals))) +
         goal_table("plan", goal_rows(score, true)) + goal_table("implant", goal_rows(score, false)) +
         "</div>\n";
}

std::string consequences_section(const Score& score, const Plan& plan) {
  if (!score.consequences) return "";
  return "<h2 class=\"next\">What it cost</h2>\n<div class=\"pair\">\n<div>\n" + needle_costs(score, plan) +
         "<p class=\"small\">A needle: the implant as it is, less the same with this needle&rsquo;s seeds "
         "where the "
         "plan has them. The costliest first.</p>\n" +
         organs(score) + failed_drops(score) + "</div>\n<div>\n" + sectors(score) +
         "<p class=\"small\">Cold: less than the prescription. Bold: more than a tenth of the "
         "sector.</p>\n</div>\n"
         "</div>\n";
}

}  // namespace brachy
