#include <fmt/format.h>

#include "apps/score/report.h"
#include "apps/score/report_charts.h"
#include "apps/score/report_figures.h"
#include "apps/score/report_page.h"
#include "apps/score/report_sections.h"
#include "core/simulation/body_settings.h"

namespace brachy {
namespace {

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
         key_figure(fmt::format("{} of {}", a ? std::to_string(a->placed.size()) : "–", score.planned_seeds),
                    fmt::format("planned seeds placed, {} missing, {} extra",
                                a ? std::to_string(a->missing.size()) : "–",
                                a ? std::to_string(a->extra.size()) : "–")) +
         key_figure(figure(a ? a->rest.total_mm.mean : kNoNumber, 1) + " mm",
                    fmt::format("mean misplacement of those placed, {} mm of it along the needle",
                                figure(a ? a->rest.axial_mm.mean : kNoNumber, 1))) +
         key_figure(change("D90", "Gy"), "prostate D90, planned → delivered") +
         key_figure(change("V100", "%"), "prostate V100, planned → delivered") + "</div>\n";
}

std::string dose_section(const DoseScore& dose) {
  const Vec3 swollen_percent = 100 * (SwellingSettings::kDayZero - Vec3::Ones());
  std::string rows;
  for (const DoseFigure& f : dose_figures())
    rows += html_row(fmt::format("{} {}, {}", f.structure, f.name, f.unit), figure_in(dose.plan, f),
                     figure_in(dose.dropped, f), figure_in(dose.rest, f), figure_in(dose.day_zero, f));
  return "<h2>Dose</h2>\n<div class=\"pair dose\">\n<div>\n" +
         html_table("",
                    {"", "planned", "as<br>dropped", "after<br>relaxation<br>(day 30)", "day 0,<br>swollen"},
                    rows) +
         fmt::format(
             "<p class=\"small\">Prescription {:g} Gy; total dose by TG-43U1 in water. {} seeds planned, {} "
             "implanted. Structures are at rest but on day 0; &ldquo;as dropped&rdquo; takes the seeds where "
             "they fell, while needles held the gland away from rest; day 0, what images of that day would "
             "say of a gland swollen by {:.0f}, {:.0f} and {:.0f} % in width, depth and length. What lies "
             "more than {:g} mm beyond the prostate&rsquo;s box is in no figure.</p>\n",
             dose.prescription_gy, dose.plan.seeds,
             dose.dropped.structures.empty() ? "–" : std::to_string(dose.dropped.seeds), swollen_percent.x(),
             swollen_percent.y(), swollen_percent.z(), dose.margin_mm) +
         "</div>\n" + to_svg_element(dvh_chart(dose)) + "</div>\n";
}

std::string error_table(const SeedsScore& score) {
  const SeedAssignment& s = score.by_position;
  const auto spread = [](const Spread& v) {
    return html_cell(figure(v.mean, 2)) + html_cell(figure(v.sd, 2)) + html_cell(figure(v.max, 2));
  };
  const auto line = [](const char* what, const std::string& cells) {
    return "<tr>" + html_cell(what) + cells + "</tr>\n";
  };
  const auto means = [](double dropped, double rest, int digits) {
    const std::string none = html_cell("") + html_cell("");
    return html_cell(figure(dropped, digits)) + none + html_cell(figure(rest, digits)) + none;
  };
  const std::string rows =
      "<tr><th></th><th colspan=\"3\">where they fell</th><th colspan=\"3\">after relaxation</th></tr>\n" +
      line("whole", spread(s.dropped.total_mm) + spread(s.rest.total_mm)) +
      line("along", spread(s.dropped.axial_mm) + spread(s.rest.axial_mm)) +
      line("across", spread(s.dropped.lateral_mm) + spread(s.rest.lateral_mm)) +
      line("along, signed", means(s.dropped.mean_signed_axial_mm, s.rest.mean_signed_axial_mm, 2)) +
      line("along, %", means(100 * s.dropped.axial_share, 100 * s.rest.axial_share, 0)) +
      line("gland's motion", spread(score.gland_motion_mm) + html_cell("") + html_cell("") + html_cell(""));
  return html_table("", {"error, mm", "mean", "SD", "max", "mean", "SD", "max"}, rows);
}

std::string seed_section(const Score& score, const Plan& plan, const TemplateGrid& grid,
                         const SurfaceMesh& prostate) {
  if (const std::string without = seeds_without_plan(score); !without.empty())
    return "<h2>Seeds</h2>\n<p>" + without + "</p>\n";
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
    rows += html_row(n.hole.empty() ? std::string("beside the template") : n.hole, planned, fallen,
                     figure(n.path_in_tissue_mm, 1), figure(n.time_in_tissue_s, 1), figure(n.passes),
                     figure(n.punctures), figure(n.largest_force_n, 2));
  }
  std::size_t all = 0;
  for (std::size_t count : fell) all += count;
  const NeedleMetrics* m = score.motion ? &*score.motion : nullptr;
  return rows + html_row(std::string("all"), std::to_string(plan.seed_count()),
                         seeds ? std::to_string(all) : "–", figure(m ? m->path_in_tissue_mm : kNoNumber, 1),
                         figure(m ? m->time_in_tissue_s : kNoNumber, 1), m ? std::to_string(m->passes) : "–",
                         figure(score.punctures), figure(score.largest_force_n, 2));
}

std::string needle_section(const NeedlesScore& score, const Plan& plan, const SeedsScore* seeds) {
  std::string out =
      "<h2 class=\"next\">Needles</h2>\n" +
      html_table(" class=\"long\"",
                 {"hole", "seeds<br>planned", "placed", "path in<br>tissue, mm", "time in<br>tissue, s",
                  "passes", "capsule<br>punctures", "largest<br>force, N"},
                 needle_rows(score, plan, seeds));
  if (score.motion) out += motion_text(*score.motion);
  return out;
}

std::string seed_table(const SeedAssignment& s, const Plan& plan, const TemplateGrid& grid) {
  std::string rows;
  for (const SeedScore& seed : s.placed)
    rows += html_row(std::to_string(seed.seed.id), std::to_string(seed.planned_index), seed.hole,
                     figure(seed.planned.offset_mm, 2), figure(seed.seed.t_s, 1),
                     figure(seed.dropped.total_mm, 2), figure(seed.dropped.axial_mm, 2),
                     figure(seed.dropped.lateral_mm, 2), figure(seed.rest.total_mm, 2),
                     figure(seed.rest.axial_mm, 2), figure(seed.rest.lateral_mm, 2),
                     figure(seed.seed.gland_motion.norm(), 2));
  const std::string unknown = "–";
  for (const Seed& seed : s.extra)
    rows +=
        html_row(std::to_string(seed.id), std::string("extra"), unknown, unknown, figure(seed.t_s, 1),
                 unknown, unknown, unknown, unknown, unknown, unknown, figure(seed.gland_motion.norm(), 2));
  const std::vector<PlannedSeed> planned = plan.seeds(grid);
  for (std::size_t i : s.missing)
    rows += html_row(std::string("missing"), std::to_string(i), plan.needles[planned[i].needle].hole,
                     figure(planned[i].offset_mm, 2), unknown, unknown, unknown, unknown, unknown, unknown,
                     unknown, unknown);
  return "<h2>Each seed</h2>\n" +
         html_table(" class=\"long\"",
                    {"seed", "in the<br>plan", "hole", "behind the<br>tip, mm", "fell<br>at, s",
                     "as dropped:<br>error, mm", "along", "across", "at rest:<br>error, mm", "along",
                     "across", "gland<br>motion, mm"},
                    rows);
}

std::string seed_slices(const Score& score, const Plan& plan, const TemplateGrid& grid) {
  std::vector<Vec3> planned, delivered;
  for (const PlannedSeed& seed : plan.seeds(grid)) planned.push_back(seed.position);
  if (score.seeds) {
    for (const SeedScore& s : score.seeds->by_position.placed) delivered.push_back(s.seed.rest);
    for (const Seed& s : score.seeds->by_position.extra) delivered.push_back(s.rest);
  }
  return slices_section(score.slices, "seeds", planned, delivered);
}

}  // namespace

std::string to_html(const Score& score, const Plan& plan, const TemplateGrid& grid,
                    const std::vector<Structure>& structures) {
  const SeedsScore* seeds = score.seeds ? &*score.seeds : nullptr;
  std::string out = page_head("Implant score", score,
                              fmt::format("{}, {:g} U each, {:g} Gy", to_string(plan.source),
                                          plan.air_kerma_strength_u, plan.prescription_gy));
  out += remarks_section(score) + keys(score) + exercise_section(score) + findings_section(score) +
         study_section(score) + goals_section(score) + seed_slices(score, plan, grid) +
         dose_section(score.dose) + consequences_section(score, plan) +
         seed_section(score, plan, grid, structures.front().mesh) +
         needle_section(score.needles, plan, seeds);
  if (seeds) out += seed_table(seeds->by_position, plan, grid);
  return out + "</body>\n</html>\n";
}

}  // namespace brachy
