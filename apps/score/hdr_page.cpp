#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/score/hdr_report.h"
#include "apps/score/report_charts.h"
#include "apps/score/report_figures.h"
#include "apps/score/report_page.h"
#include "apps/score/report_sections.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {
namespace {

std::string hdr_keys(const FractionReport& report) {
  const CathetersScore& c = *report.score.catheters;
  const auto change = [&](const char* name) {
    const auto f = std::ranges::find_if(hdr_figures(), [&](const HdrFigure& figure) {
      return figure.structure == std::string_view("prostate") && figure.name == std::string_view(name);
    });
    const double gy = report.fraction.prescription_gy;
    return fmt::format("{} → {} %", figure(f->of(report.fraction.plan, gy), 1),
                       figure(f->of(report.fraction.delivered, gy), 1));
  };
  return "<div class=\"keys\">\n" +
         key_figure(fmt::format("{} of {}", c.placed, c.placed + c.missing),
                    fmt::format("planned catheters placed, {} missing, {} extra", c.missing, c.unplanned)) +
         key_figure(figure(c.mean_mm, 1) + " mm",
                    fmt::format("mean distance of dwell positions from the planned ones, {} mm at most",
                                figure(c.largest_mm, 1))) +
         key_figure(change("D90"), "prostate D90, planned → delivered") +
         key_figure(change("V100"), "prostate V100, planned → delivered") + "</div>\n";
}

std::string hdr_dose_section(const FractionReport& report) {
  const HdrScore& fraction = report.fraction;
  const double gy = fraction.prescription_gy;
  std::string rows;
  for (const HdrFigure& f : hdr_figures()) {
    if (!std::isfinite(f.of(fraction.plan, gy))) continue;
    rows += "<tr>" + html_cell(fmt::format("{} {}, %", f.structure, f.name));
    for (const auto* doses : {&fraction.plan, &fraction.delivered, &fraction.reoptimised}) {
      const double percent = f.of(*doses, gy);
      rows += html_cell(figure(percent, 1),
                        std::isfinite(percent) && !f.is_met_by(percent) ? " class=\"missed\"" : "");
    }
    rows += html_cell(f.goal == 0 ? "" : fmt::format("{} {:g}", f.is_least ? "≥" : "≤", f.goal)) + "</tr>\n";
  }
  return "<h2>Dose</h2>\n<div class=\"pair dose\">\n<div>\n" +
         html_table("", {"", "planned", "delivered", "times<br>optimised<br>again", "usual"}, rows) +
         fmt::format(
             "<p class=\"small\">TG-43U1 in water, {} dwells, {:.0f} s in all. Percent of the volume, or of "
             "the "
             "prescription. Delivered: the planned times where the catheters lie in the tissue at rest; "
             "optimised "
             "again: other times there. What lies more than {:g} mm beyond the prostate&rsquo;s box is in no "
             "figure.</p>\n",
             report.plan.dwell_count(), report.plan.total_s(), report.score.dose.margin_mm) +
         "</div>\n" + to_svg_element(dvh_chart(report.score.dose, "delivered")) + "</div>\n";
}

/// What went through the catheter's hole; null: not known.
const NeedleScore* needle_through(const Score& score, const std::string& hole) {
  const auto found = std::ranges::find(score.needles.needles, hole, &NeedleScore::hole);
  return hole.empty() || found == score.needles.needles.end() ? nullptr : &*found;
}

std::string catheter_section(const FractionReport& report) {
  std::string rows;
  for (const CatheterScore& c : report.fraction.catheters) {
    const PlanCatheter& planned = report.plan.catheters[c.planned];
    const PlanCatheter& again = report.fraction.reoptimised_plan.catheters[c.planned];
    const auto seconds = [](const PlanCatheter& catheter) {
      double sum = 0;
      for (const double s : catheter.dwell_s) sum += s;
      return figure(sum, 1);
    };
    const auto mm = [&](double value) { return figure(c.needle ? value : kNoNumber, 1); };
    const NeedleScore* n = needle_through(report.score, planned.hole);
    rows += html_row(planned.label(), c.needle ? std::to_string(*c.needle) : std::string("missing"),
                     mm(c.along_mm), mm(c.across_mm), mm(c.mean_mm), mm(c.largest_mm), seconds(planned),
                     c.needle ? seconds(again) : "–",
                     figure(c.mean_gy.empty() ? kNoNumber : c.mean_gy.front(), 2),
                     figure(n ? n->passes : std::nullopt), figure(n ? n->largest_force_n : kNoNumber, 2));
  }
  constexpr std::size_t kUnknown = 9;  // columns
  for (const std::uint32_t needle : report.fraction.unplanned) {
    rows += "<tr>" + html_cell("not planned") + html_cell(std::to_string(needle));
    for (std::size_t i = 0; i < kUnknown; ++i) rows += html_cell("–");
    rows += "</tr>\n";
  }
  std::string out =
      "<h2 class=\"next\">Catheters</h2>\n" +
      html_table(" class=\"long\"",
                 {"hole", "needle", "tip along,<br>mm", "tip across,<br>mm", "dwells off,<br>mean, mm",
                  "at most,<br>mm", "planned,<br>s", "optimised<br>again, s", "gland,<br>mean, Gy", "passes",
                  "largest<br>force, N"},
                 rows) +
      "<p class=\"small\">Along: &gt; 0 too deep. Tips are where they lie now; dwell positions where "
      "their tissue is at rest. Gland: what the catheter adds to the mean dose of the first structure, with "
      "the planned times. Needles are matched with planned catheters by where they pass the "
      "template.</p>\n";
  if (report.score.needles.motion) out += motion_text(*report.score.needles.motion);
  return out;
}

}  // namespace

std::string to_html(const FractionReport& report, const TemplateGrid& grid) {
  const Score& score = report.score;
  std::vector<Vec3> planned;
  for (const Dwell& dwell : report.plan.dwells(grid)) planned.push_back(dwell.position);
  return page_head("Fraction score", score,
                   fmt::format("{}, {:g} U, a fraction of {:g} Gy", to_string(report.plan.source),
                               report.plan.source_strength_u, report.plan.prescription_gy)) +
         remarks_section(score) + hdr_keys(report) + exercise_section(score) + findings_section(score) +
         goals_section(score) +
         slices_section(score.slices, "dwell positions", planned, report.fraction.dwells) +
         hdr_dose_section(report) + catheter_section(report) + "</body>\n</html>\n";
}

}  // namespace brachy
