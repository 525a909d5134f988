#include <fmt/format.h>

#include "apps/score/report.h"
#include "apps/score/report_charts.h"
#include "apps/score/report_figures.h"
#include "apps/score/report_sections.h"

namespace brachy {
namespace {

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Implant score: {}</title>
<style>
@page {{ size: A4; margin: 9mm 11mm }}
body {{ font: 10pt/1.3 sans-serif; color: #222; max-width: 188mm; margin: 6mm auto; padding: 0 2mm }}
h1 {{ font-size: 15pt; margin: 0 }}
h2 {{ font-size: 11.5pt; margin: 3mm 0 1mm; break-after: avoid }}
p {{ margin: 1mm 0 }}
table {{ border-collapse: collapse; font-variant-numeric: tabular-nums }}
th, td {{ padding: .4mm 2mm; text-align: right; border-bottom: .2mm solid #ddd }}
th {{ font-weight: 600; border-bottom-color: #888; vertical-align: bottom }}
th:first-child, td:first-child, .left {{ text-align: left }}
tr {{ break-inside: avoid }}
svg {{ width: 100%; height: auto; display: block }}
.pair {{ display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); )"
                              R"(gap: 2mm 4mm; align-items: start; break-inside: avoid }}
.keys {{ display: grid; grid-template-columns: repeat(4, 1fr); gap: 3mm; margin: 2mm 0; font-size: 9pt }}
.keys div {{ border: .2mm solid #bbb; padding: 1.5mm 2mm }}
.keys b {{ display: block; font-size: 12pt; white-space: nowrap; letter-spacing: -.01em }}
.small {{ font-size: 8pt; color: #555 }}
.remarks {{ border-left: 1mm solid #d55e00; padding-left: 2mm; margin: 2mm 0 }}
.dose {{ grid-template-columns: minmax(0, 1.2fr) minmax(0, 1fr) }}
.pair table {{ font-size: 8.5pt; width: 100% }}
.pair th, .pair td {{ padding: .3mm 1.2mm; white-space: nowrap }}
.missed {{ font-weight: 700; color: #b03000 }}
.pair .goals {{ font-size: 7pt }}
.pair .goals th, .pair .goals td {{ padding: .2mm .7mm }}
.verdict {{ font-weight: 600 }}
.verdict::first-letter, li::first-letter {{ text-transform: uppercase }}
ol {{ margin: 1mm 0; padding-left: 6mm }}
.scroll {{ overflow-x: auto }}
.slices {{ display: grid; grid-template-columns: repeat(5, minmax(0, 1fr)); gap: 1mm; break-inside: avoid }}
.slices svg {{ border: .2mm solid #ddd }}
.long {{ font-size: 8pt; width: 100% }}
.long th, .long td {{ padding: .2mm 1.2mm }}
@media print {{
body {{ font-size: 9pt; margin: 0 auto }}
h2 {{ margin-top: 2mm }}
.keys {{ font-size: 8.5pt; margin: 1mm 0 }}
.small {{ font-size: 7.5pt }}
.dose table {{ font-size: 8pt }}
.long {{ font-size: 7pt; line-height: 1.15 }}
.long th, .long td {{ padding: .15mm 1.2mm }}
.next {{ break-before: page }}
.scroll {{ overflow: visible }}
}}
@media screen and (max-width: 600px) {{
.pair, .dose {{ grid-template-columns: minmax(0, 1fr) }}
.keys {{ grid-template-columns: repeat(2, minmax(0, 1fr)) }}
.slices {{ grid-template-columns: repeat(3, minmax(0, 1fr)) }}
}}
</style>
</head>
<body>
)";

std::string cell(const std::string& text, const char* attributes = "") {
  return fmt::format("<td{}>{}</td>", attributes, xml_escaped(text));
}

template <class... Text>
std::string row(const Text&... cells) {
  return "<tr>" + (cell(cells) + ...) + "</tr>\n";
}

/// Headings may hold line breaks, and are ours: not escaped.
std::string table(const char* attributes, std::initializer_list<const char*> headings,
                  const std::string& rows) {
  std::string out = fmt::format("<table{}>\n<thead><tr>", attributes);
  for (const char* heading : headings) out += fmt::format("<th>{}</th>", heading);
  return "<div class=\"scroll\">\n" + out + "</tr></thead>\n<tbody>\n" + rows +
         "</tbody>\n</table>\n</div>\n";
}

std::string key(const std::string& value, const std::string& what) {
  return fmt::format("<div><b>{}</b>{}</div>\n", xml_escaped(value), xml_escaped(what));
}

/// The session in four figures.
std::string keys(const Score& score) {
  const SeedAssignment* a = score.seeds ? &score.seeds->by_position : nullptr;
  const auto of_prostate = [&](const DoseStage& stage, const char* name) {
    for (const DoseFigure& f : dose_figures())
      if (f.structure == std::string_view("prostate") && f.name == std::string_view(name))
        return figure_in(stage, f);
    return figure(kNoNumber, 0);
  };
  const auto change = [&](const char* name, const char* unit) {
    return fmt::format("{} → {} {}", of_prostate(score.dose.plan, name), of_prostate(score.dose.rest, name),
                       unit);
  };
  return "<div class=\"keys\">\n" +
         key(fmt::format("{} of {}", a ? std::to_string(a->placed.size()) : "–", score.planned_seeds),
             fmt::format("planned seeds placed, {} missing, {} extra",
                         a ? std::to_string(a->missing.size()) : "–",
                         a ? std::to_string(a->extra.size()) : "–")) +
         key(figure(a ? a->rest.total_mm.mean : kNoNumber, 1) + " mm",
             fmt::format("mean misplacement of those placed, {} mm of it along the needle",
                         figure(a ? a->rest.axial_mm.mean : kNoNumber, 1))) +
         key(change("D90", "Gy"), "prostate D90, planned → delivered") +
         key(change("V100", "%"), "prostate V100, planned → delivered") + "</div>\n";
}

std::string remarks(const Score& score) {
  std::string out;
  for (const std::string& remark : score.remarks) out += "<p>" + xml_escaped(remark) + "</p>\n";
  return out.empty() ? "" : "<div class=\"remarks\">\n" + out + "</div>\n";
}

std::string findings_list(const Score& score) {
  std::string out;
  for (std::size_t i = 0; i < std::min(score.findings.size(), kTopFindings); ++i)
    out += "<li>" + xml_escaped(score.findings[i].text) + "</li>\n";
  if (!out.empty()) out = "<h2>What went wrong</h2>\n<ol>\n" + out + "</ol>\n";
  return out +
         (score.unexplained ? "<p class=\"small\">" + xml_escaped(unexplained_text(score)) + "</p>\n" : "");
}

std::string dose_section(const DoseScore& dose) {
  std::string rows;
  for (const DoseFigure& f : dose_figures())
    rows += row(fmt::format("{} {}, {}", f.structure, f.name, f.unit), figure_in(dose.plan, f),
                figure_in(dose.dropped, f), figure_in(dose.rest, f));
  return "<h2>Dose</h2>\n<div class=\"pair dose\">\n<div>\n" +
         table("", {"", "planned", "as<br>dropped", "after<br>relaxation"}, rows) +
         fmt::format(
             "<p class=\"small\">Prescription {:g} Gy; total dose by TG-43U1 in water. {} seeds planned, {} "
             "implanted. Structures are at rest throughout; &ldquo;as dropped&rdquo; takes the seeds where "
             "they fell, while needles held the gland away from rest. What lies more than {:g} mm beyond "
             "the prostate&rsquo;s box is in no figure.</p>\n",
             dose.prescription_gy, dose.plan.seeds,
             dose.dropped.structures.empty() ? "–" : std::to_string(dose.dropped.seeds), dose.margin_mm) +
         "</div>\n" + to_svg_element(dvh_chart(dose)) + "</div>\n";
}

std::string error_table(const SeedsScore& score) {
  const SeedAssignment& s = score.by_position;
  const auto spread = [](const Spread& v) {
    return cell(figure(v.mean, 2)) + cell(figure(v.sd, 2)) + cell(figure(v.max, 2));
  };
  const auto line = [](const char* what, const std::string& cells) {
    return "<tr>" + cell(what) + cells + "</tr>\n";
  };
  const auto means = [](double dropped, double rest, int digits) {
    const std::string none = cell("") + cell("");
    return cell(figure(dropped, digits)) + none + cell(figure(rest, digits)) + none;
  };
  const std::string rows =
      "<tr><th></th><th colspan=\"3\">where they fell</th><th colspan=\"3\">after relaxation</th></tr>\n" +
      line("whole", spread(s.dropped.total_mm) + spread(s.rest.total_mm)) +
      line("along", spread(s.dropped.axial_mm) + spread(s.rest.axial_mm)) +
      line("across", spread(s.dropped.lateral_mm) + spread(s.rest.lateral_mm)) +
      line("along, signed", means(s.dropped.mean_signed_axial_mm, s.rest.mean_signed_axial_mm, 2)) +
      line("along, %", means(100 * s.dropped.axial_share, 100 * s.rest.axial_share, 0)) +
      line("gland's motion", spread(score.gland_motion_mm) + cell("") + cell("") + cell(""));
  return table("", {"error, mm", "mean", "SD", "max", "mean", "SD", "max"}, rows);
}

std::string seed_section(const Score& score, const Plan& plan, const TemplateGrid& grid,
                         const SurfaceMesh& prostate) {
  if (!score.seeds) return "<h2>Seeds</h2>\n<p>Not known.</p>\n";
  const SeedsScore& s = *score.seeds;
  const auto map = [&](int away) {
    return to_svg_element(displacement_chart(s, plan, grid, prostate, away));
  };
  const auto pair = [](const std::string& left, const std::string& right) {
    return "<div class=\"pair\">\n" + left + right + "</div>\n";
  };
  return "<h2>Where the seeds are</h2>\n" + pair(map(1), map(0)) +
         pair(to_svg_element(error_chart(s)),
              "<div>\n" + error_table(s) +
                  "<p class=\"small\">Arrows go from where a seed was planned to where it fell and on to "
                  "where it lies once all needles are out. Seeds are matched with planned ones by position, "
                  "whatever needle they came from, so that the sum of distances is least; a pair further "
                  "apart than " +
                  fmt::format("{:g}", SeedAssignment::kFarthestMm) +
                  " mm is an extra seed and a missing one. Grey outline: the prostate&rsquo;s convex hull. "
                  "Along: on the planned needle, &gt; 0 too deep; across: off it. Along, %: mean size of "
                  "that part over the mean of the whole. Gland: mean motion of the tissue when a seed "
                  "fell.</p>\n</div>\n");
}

std::string needle_rows(const NeedlesScore& score, const Plan& plan, const SeedsScore* seeds) {
  std::vector<std::size_t> fell(plan.needles.size(), 0);
  if (seeds)
    for (const SeedScore& s : seeds->by_position.placed) ++fell[s.planned.needle];
  std::string rows;
  for (const NeedleScore& n : score.needles) {
    const std::string planned =
        n.planned ? std::to_string(plan.needles[*n.planned].seed_offsets_mm().size()) : "none";
    const std::string fallen = n.planned && seeds ? std::to_string(fell[*n.planned]) : "–";
    rows += row(n.hole.empty() ? std::string("beside the template") : n.hole, planned, fallen,
                figure(n.path_in_tissue_mm, 1), figure(n.time_in_tissue_s, 1), figure(n.passes),
                figure(n.punctures), figure(n.largest_force_n, 2));
  }
  std::size_t all = 0;
  for (std::size_t count : fell) all += count;
  const NeedleMetrics* m = score.motion ? &*score.motion : nullptr;
  return rows + row(std::string("all"), std::to_string(plan.seed_count()), seeds ? std::to_string(all) : "–",
                    figure(m ? m->path_in_tissue_mm : kNoNumber, 1),
                    figure(m ? m->time_in_tissue_s : kNoNumber, 1), m ? std::to_string(m->passes) : "–",
                    figure(score.punctures), figure(score.largest_force_n, 2));
}

std::string needle_section(const NeedlesScore& score, const Plan& plan, const SeedsScore* seeds) {
  std::string out = "<h2 class=\"next\">Needles</h2>\n" +
                    table(" class=\"long\"",
                          {"hole", "seeds<br>planned", "placed", "path in<br>tissue, mm",
                           "time in<br>tissue, s", "passes", "capsule<br>punctures", "largest<br>force, N"},
                          needle_rows(score, plan, seeds));
  if (const auto& m = score.motion)
    out += fmt::format(
        "<p class=\"small\">{} s in all, {} mm of tip path; tip speed p50 {}, p95 {}, at most {} mm/s. "
        "Path, time and passes as Perk Tutor defines them, against the prostate at rest. Punctures are of "
        "the outer capsule, as the force log shows them.</p>\n",
        figure(m->elapsed_time_s, 1), figure(m->path_length_mm, 0), figure(m->speed_p50_mm_s, 1),
        figure(m->speed_p95_mm_s, 1), figure(m->speed_max_mm_s, 1));
  return out;
}

std::string seed_table(const SeedAssignment& s, const Plan& plan, const TemplateGrid& grid) {
  std::string rows;
  for (const SeedScore& seed : s.placed)
    rows += row(std::to_string(seed.seed.id), std::to_string(seed.planned_index), seed.hole,
                figure(seed.planned.offset_mm, 2), figure(seed.seed.t_s, 1), figure(seed.dropped.total_mm, 2),
                figure(seed.dropped.axial_mm, 2), figure(seed.dropped.lateral_mm, 2),
                figure(seed.rest.total_mm, 2), figure(seed.rest.axial_mm, 2), figure(seed.rest.lateral_mm, 2),
                figure(seed.seed.gland_motion.norm(), 2));
  const std::string unknown = "–";
  for (const Seed& seed : s.extra)
    rows += row(std::to_string(seed.id), std::string("extra"), unknown, unknown, figure(seed.t_s, 1), unknown,
                unknown, unknown, unknown, unknown, unknown, figure(seed.gland_motion.norm(), 2));
  const std::vector<PlannedSeed> planned = plan.seeds(grid);
  for (std::size_t i : s.missing)
    rows += row(std::string("missing"), std::to_string(i), plan.needles[planned[i].needle].hole,
                figure(planned[i].offset_mm, 2), unknown, unknown, unknown, unknown, unknown, unknown,
                unknown, unknown);
  return "<h2>Each seed</h2>\n" + table(" class=\"long\"",
                                        {"seed", "in the<br>plan", "hole", "behind the<br>tip, mm",
                                         "fell<br>at, s", "as dropped:<br>error, mm", "along", "across",
                                         "at rest:<br>error, mm", "along", "across", "gland<br>motion, mm"},
                                        rows);
}

}  // namespace

std::string to_html(const Score& score, const Plan& plan, const TemplateGrid& grid,
                    const std::vector<Structure>& structures) {
  const SeedsScore* seeds = score.seeds ? &*score.seeds : nullptr;
  std::string out = fmt::format(kHead, xml_escaped(score.recording));
  out += fmt::format("<h1>Implant score</h1>\n<p>Recording <b>{}</b>, plan <b>{}</b>. {}</p>\n",
                     xml_escaped(score.recording), xml_escaped(score.plan), kNotice);
  out += remarks(score) + keys(score) + findings_list(score) + study_section(score) + goals_section(score) +
         slices_section(score, plan, grid) + dose_section(score.dose) + consequences_section(score, plan) +
         seed_section(score, plan, grid, structures.front().mesh) +
         needle_section(score.needles, plan, seeds);
  if (seeds) out += seed_table(seeds->by_position, plan, grid);
  return out + "</body>\n</html>\n";
}

}  // namespace brachy
