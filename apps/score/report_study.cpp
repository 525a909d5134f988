#include <fmt/format.h>

#include "apps/score/report_figures.h"
#include "apps/score/report_sections.h"

namespace brachy {
namespace {

std::string volume_error(const ContourScore& score) {
  return score.step_mm > 0 ? fmt::format("{:+.1f}", score.volume_error_percent()) : "–";
}

std::string study_row(const Score::Study& study) {
  const ContourScore& s = study.score;
  return fmt::format(
      "<tr><td>{:.0f}</td><td>{:.3f}</td><td>{:.2f}</td><td>{:.2f}</td><td>{}</td><td>{:.2f}</td>"
      "<td>{:.2f}</td><td>{:.2f}</td><td>{}</td><td>{}</td></tr>\n",
      study.t_s, s.dice, s.outlined_cm3, s.gland_cm3, volume_error(s), s.hausdorff_mm, s.hausdorff_95_mm,
      s.mean_mm, s.missed, s.beyond);
}

std::string plane_row(const SliceScore& s) {
  const bool has_both = !s.is_missed() && !s.is_beyond();
  return fmt::format(
      "<tr><td>{}</td><td>{:.1f}</td><td>{:.0f}</td><td>{:.0f}</td><td>{:.3f}</td><td>{}</td></tr>\n",
      s.slice ? std::to_string(*s.slice + 1) : "missed", s.offset_mm, s.areas.first, s.areas.second, s.dice(),
      has_both ? figure(s.hausdorff_mm, 2) : "–");
}

}  // namespace

std::string study_section(const Score& score) {
  if (score.studies.empty()) return "";
  std::string out =
      "<h2>Volume study</h2>\n<table>\n<tr><th>at, s</th><th>Dice</th><th>outlined,<br>cm³</th>"
      "<th>gland,<br>cm³</th><th>error, %</th><th>Hausdorff,<br>mm</th><th>95 %,<br>mm</th>"
      "<th>mean,<br>mm</th><th>planes<br>missed</th><th>beyond<br>the gland</th></tr>\n";
  for (const Score::Study& study : score.studies) out += study_row(study);
  out +=
      "</table>\n<table>\n<tr><th>slice</th><th>offset, mm</th><th>outlined,<br>mm²</th>"
      "<th>gland, mm²</th><th>Dice</th><th>Hausdorff,<br>mm</th></tr>\n";
  for (const SliceScore& plane : score.studies.back().score.slices) out += plane_row(plane);
  return out +
         "</table>\n<p class=\"small\">Against the gland as it was deformed when each slice was outlined. "
         "Outlined: areas times the step between planes. Planes of the last study.</p>\n";
}

std::string study_lines(const Score& score) {
  std::string text;
  for (const auto& [t_s, s] : score.studies)
    text += fmt::format(
        "volume study at {:.0f} s: Dice {:.3f}, {:.2f} cm3 outlined, {:.2f} cm3 true: {} %; Hausdorff {:.2f} "
        "mm, 95 % {:.2f} mm; {} planes missed, {} beyond the gland\n",
        t_s, s.dice, s.outlined_cm3, s.gland_cm3, volume_error(s), s.hausdorff_mm, s.hausdorff_95_mm,
        s.missed, s.beyond);
  return text;
}

}  // namespace brachy
