#include "apps/score/report_page.h"

#include <algorithm>

#include "apps/score/report.h"
#include "apps/score/report_figures.h"

namespace brachy {
namespace {

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{}</title>
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
.verdict::first-letter, li::first-letter, .about::first-letter {{ text-transform: uppercase }}
ol {{ margin: 1mm 0; padding-left: 6mm }}
.scroll {{ overflow-x: auto }}
.slices {{ display: grid; grid-template-columns: repeat(5, minmax(0, 1fr)); gap: 1mm; break-inside: avoid }}
.slices svg {{ border: .2mm solid #ddd }}
.long {{ font-size: 8pt; width: 100% }}
.long th, .long td {{ padding: .2mm 1.2mm }}
.worded th:last-child {{ text-align: left }}
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

}  // namespace

std::string page_start(const std::string& title) {
  return fmt::format(kHead, xml_escaped(title));
}

std::string page_head(const char* title, const Score& score, const std::string& sources) {
  std::string about;
  const auto add = [&](const char* what, const std::string& text) {
    if (!text.empty())
      about += fmt::format("{}{} <b>{}</b>", about.empty() ? "" : ", ", what, xml_escaped(text));
  };
  add("Trainee", score.about.trainee);
  add("exercise", score.about.exercise);
  add("begun", score.about.began);
  add("recording", score.recording);
  add("plan", score.plan);
  return page_start(fmt::format("{}: {}", title, score.recording)) +
         fmt::format("<h1>{}</h1>\n<p class=\"about\">{}: {}. {}</p>\n", title, about, xml_escaped(sources),
                     kNotice);
}

std::string html_cell(const std::string& text, const char* attributes) {
  return fmt::format("<td{}>{}</td>", attributes, xml_escaped(text));
}

std::string html_table(const char* attributes, const std::vector<std::string>& headings,
                       const std::string& rows) {
  std::string out = fmt::format("<table{}>\n<thead><tr>", attributes);
  for (const std::string& heading : headings) out += fmt::format("<th>{}</th>", heading);
  return "<div class=\"scroll\">\n" + out + "</tr></thead>\n<tbody>\n" + rows +
         "</tbody>\n</table>\n</div>\n";
}

std::string key_figure(const std::string& value, const std::string& what) {
  return fmt::format("<div><b>{}</b>{}</div>\n", xml_escaped(value), xml_escaped(what));
}

std::string remarks_section(const Score& score) {
  std::string out;
  for (const std::string& remark : score.remarks) out += "<p>" + xml_escaped(remark) + "</p>\n";
  return out.empty() ? "" : "<div class=\"remarks\">\n" + out + "</div>\n";
}

std::string exercise_section(const Score& score) {
  if (!score.exercise) return "";
  std::string bounds;
  for (const BoundResult& bound : score.exercise->bounds)
    bounds += fmt::format("{}<span{}>{}</span>", bounds.empty() ? "" : "; ",
                          bound.is_kept ? "" : " class=\"missed\"", xml_escaped(bound.text));
  return fmt::format("<p>Exercise &ldquo;{}&rdquo;: <b{}>{}</b> ({}).</p>\n",
                     xml_escaped(score.exercise->name),
                     score.exercise->has_passed() ? "" : " class=\"missed\"",
                     score.exercise->has_passed() ? "passed" : "not passed", bounds);
}

std::string findings_section(const Score& score) {
  std::string out;
  for (std::size_t i = 0; i < std::min(score.findings.size(), kTopFindings); ++i)
    out += "<li>" + xml_escaped(score.findings[i].text) + "</li>\n";
  if (!out.empty()) out = "<h2>What went wrong</h2>\n<ol>\n" + out + "</ol>\n";
  return out +
         (score.unexplained ? "<p class=\"small\">" + xml_escaped(unexplained_text(score)) + "</p>\n" : "");
}

std::string motion_text(const NeedleMetrics& m) {
  return fmt::format(
      "<p class=\"small\">{} s in all, {} mm of tip path; tip speed p50 {}, p95 {}, at most {} mm/s. "
      "Path, time and passes as Perk Tutor defines them, against the prostate at rest. Punctures are of "
      "the outer capsule, as the force log shows them.</p>\n",
      figure(m.elapsed_time_s, 1), figure(m.path_length_mm, 0), figure(m.speed_p50_mm_s, 1),
      figure(m.speed_p95_mm_s, 1), figure(m.speed_max_mm_s, 1));
}

}  // namespace brachy
