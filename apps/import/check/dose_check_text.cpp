#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/charts/gray_png.h"
#include "apps/charts/svg_chart.h"
#include "apps/import/check/dose_check.h"
#include "core/brachytherapy/dose/source.h"
#include "core/geometry/contours/mesh_contours.h"

namespace brachy {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json();
}

Json json_of(const DoseDifference& d) {
  return {{"points", d.points},
          {"mean_percent", d.mean_percent},
          {"rms_percent", d.rms_percent},
          {"largest_percent", d.largest_percent}};
}

Json json_of(const StructureDose& f) {
  return {{"mean_gy", number(f.mean_gy)},     {"D90_gy", number(f.d90_gy)},
          {"D10_gy", number(f.d10_gy)},       {"D2cc_gy", number(f.d2cc_gy)},
          {"D0.1cc_gy", number(f.d0_1cc_gy)}, {"V100_percent", f.v100_percent},
          {"V150_percent", f.v150_percent}};
}

Json json_of(const std::vector<GammaPass>& gamma) {
  Json all = Json::array();
  for (const GammaPass& g : gamma)
    all.push_back({{"percent", g.percent}, {"mm", g.mm}, {"pass_percent", g.pass_percent}});
  return all;
}

Json json_of(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

/// A figure of both doses: "16.01 / 16.20".
std::string of_both(double file, double recomputed) {
  const auto text = [](double v) { return std::isfinite(v) ? fmt::format("{:.2f}", v) : std::string("–"); };
  return text(file) + " / " + text(recomputed);
}

struct FigureColumn {
  const char* title;
  double StructureDose::*value;
};
constexpr FigureColumn kFigures[] = {
    {"mean, Gy", &StructureDose::mean_gy},     {"D90, Gy", &StructureDose::d90_gy},
    {"D10, Gy", &StructureDose::d10_gy},       {"D2cc, Gy", &StructureDose::d2cc_gy},
    {"D0.1cc, Gy", &StructureDose::d0_1cc_gy}, {"V100, %", &StructureDose::v100_percent},
    {"V150, %", &StructureDose::v150_percent}};

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Dose check</title>
<style>
body { font: 10pt/1.35 sans-serif; color: #222; max-width: 210mm; margin: 6mm auto; padding: 0 2mm }
h1 { font-size: 15pt; margin: 0 }
h2 { font-size: 11.5pt; margin: 4mm 0 1mm }
table { border-collapse: collapse; font-variant-numeric: tabular-nums }
th, td { padding: .4mm 2mm; text-align: right; border-bottom: .2mm solid #ddd }
th:first-child, td:first-child { text-align: left }
svg { width: 100%; height: auto; display: block }
.three { display: grid; grid-template-columns: repeat(3, minmax(0, 1fr)); gap: 2mm }
.verdict { font-weight: 600 }
.findings { border-left: 1mm solid #d55e00; padding-left: 6mm; margin: 2mm 0 }
.scroll { overflow-x: auto }
.small { font-size: 8pt; color: #555 }
@page { size: A4; margin: 9mm 11mm }
</style>
</head>
<body>
)";

/// A transverse plane as a picture: a value for each place of a square, and the structures' outlines.
class Plane {
 public:
  Plane(const Vec3& middle, double half_mm, const std::vector<Structure>& structures)
      : middle_(middle), half_mm_(half_mm) {
    for (const Structure& s : structures)
      for (const auto& line : mesh_contours(s.mesh, middle.z())) {
        outlines_ += "<polygon points=\"";
        for (const Vec2& p : line)
          outlines_ += fmt::format("{:.1f},{:.1f} ", px(-(p.x() - middle.x())), px(-(p.y() - middle.y())));
        outlines_ += "\" fill=\"none\" stroke=\"#0072b2\" stroke-width=\"1.5\"/>\n";
      }
  }

  /// `shade` returns 0 … 1, or NaN where there is nothing.
  template <class Shade>
  std::string svg(const std::string& title, const Shade& shade) const {
    constexpr std::size_t kSize = 160;
    std::vector<std::uint8_t> pixels;
    for (std::size_t row = 0; row < kSize; ++row)
      for (std::size_t column = 0; column < kSize; ++column) {
        const auto along = [&](std::size_t n) {
          return (2 * (static_cast<double>(n) + 0.5) / kSize - 1) * half_mm_;
        };
        const double value = shade(Vec3(middle_ + Vec3(-along(column), -along(row), 0)));
        pixels.push_back(std::isnan(value)
                             ? 255
                             : static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0))));
      }
    return fmt::format(
        "<figure style=\"margin:0\"><figcaption class=\"small\">{}</figcaption>"
        "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">"
        "<image width=\"{}\" height=\"{}\" href=\"data:image/png;base64,{}\"/>\n{}</svg></figure>\n",
        xml_escaped(title), kPx, kPx, xml_escaped(title), kPx, kPx, to_base64(to_png({kSize, kSize, pixels})),
        outlines_);
  }

 private:
  static constexpr double kPx = 320;
  double px(double mm) const { return 0.5 * kPx * (1 + mm / half_mm_); }

  Vec3 middle_;
  double half_mm_;
  std::string outlines_;
};

std::string pictures(const HdrPlan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                     const VoxelVolume& dose) {
  const std::vector<DoseSeed> seeds = plan.seeds(grid);
  Eigen::AlignedBox3d box;
  for (const DoseSeed& seed : seeds) box.extend(seed.position);
  const double half_mm = std::max(25.0, 0.5 * box.sizes().head<2>().maxCoeff() + 15);
  const Vec3 middle = box.center(), around(half_mm, half_mm, 2);
  DoseGrid recomputed(middle - around, middle + around, 1);
  for (const DoseSeed& seed : seeds) recomputed.add(seed);
  const Volume file(dose.grid, dose.values);
  const Plane plane(middle, half_mm, structures);
  const auto file_at = [&](const Vec3& p) {
    return file.contains(p) ? static_cast<double>(file.at(p)) : NAN;
  };
  constexpr double kWhitePercent = 200, kFullPercent = 10;
  const double white = 0.01 * kWhitePercent * plan.prescription_gy;
  return fmt::format("<h2>Transverse plane z = {:.1f} mm (RAS; the patient's right is on the left)</h2>\n",
                     middle.z()) +
         "<div class=\"three\">\n" +
         plane.svg("the file's dose; white: 200 % of the prescription",
                   [&](const Vec3& p) { return file_at(p) / white; }) +
         plane.svg("recomputed", [&](const Vec3& p) { return recomputed.at(p) / white; }) +
         plane.svg("difference; gray: none, white: recomputed 10 % more, black: 10 % less",
                   [&](const Vec3& p) {
                     const double percent = 100 * (recomputed.at(p) / file_at(p) - 1);
                     return 0.5 + 0.5 * percent / kFullPercent;
                   }) +
         "</div>\n";
}

Chart dvh_chart_of(const DoseCheck& check) {
  constexpr const char* kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                      "#e69f00", "#56b4e9", "#000000"};
  Chart chart{.title = "Dose-volume histograms: solid the file's dose, dashed recomputed",
              .x_label = "dose, % of the prescription",
              .y_label = "volume, %"};
  std::size_t n = 0;
  for (const FiguresOfBoth& s : check.structures) {
    const std::string colour = kColours[n++ % std::size(kColours)];
    for (const StructureDose* dose : {&s.file, &s.recomputed}) {
      ChartLine line{
          .name = dose == &s.file ? s.name : "", .colour = colour, .dashes = dose == &s.file ? "" : "5 3"};
      for (std::size_t percent = 0; percent < dose->volume_share.size(); percent += 2) {
        line.x.push_back(static_cast<double>(percent));
        line.y.push_back(100 * static_cast<double>(dose->volume_share[percent]));
      }
      if (s.volume_cc > 0) chart.lines.push_back(std::move(line));
    }
  }
  return chart;
}

std::string row_of(const std::string& what, const DoseDifference& d) {
  return fmt::format("<tr><td>{}</td><td>{}</td><td>{:+.2f}</td><td>{:.2f}</td><td>{:.1f}</td></tr>\n",
                     xml_escaped(what), d.points, d.mean_percent, d.rms_percent, d.largest_percent);
}

}  // namespace

std::string shift_text(const Vec3& v) {
  const auto rounded = [](double mm) { return std::round(100 * mm) / 100 + 0.0; };  // no -0
  return fmt::format("({:+.2f}, {:+.2f}, {:+.2f}) mm", rounded(v.x()), rounded(v.y()), rounded(v.z()));
}

std::string to_text(const DoseCheck& check, const HdrPlan& plan) {
  std::string text =
      fmt::format("check-dose: {}: {} catheters, {} dwells in {:.1f} s, {} of {:g} U; {:g} Gy\n", plan.name,
                  plan.catheters.size(), plan.dwell_count(), plan.total_s(),
                  tg43_source(plan.source).description, plan.source_strength_u, plan.prescription_gy);
  text += fmt::format("  recomputed against the file, at voxels above {:g} Gy and {:g} mm from dwells:\n",
                      check.settings.least_gy, check.settings.beside_mm);
  text += fmt::format("  {:<44}{:>9}{:>9}{:>9}{:>10}\n", "", "points", "mean, %", "rms, %", "largest, %");
  const auto line = [&](const std::string& what, const DoseDifference& d) {
    text += fmt::format("  {:<44}{:>9}{:>+9.2f}{:>9.2f}{:>10.1f}\n", what, d.points, d.mean_percent,
                        d.rms_percent, d.largest_percent);
  };
  line("as stored", check.as_stored);
  line("file's grid moved " + shift_text(check.shift_mm), check.shifted);
  line(fmt::format("dwells moved {:+.2f} mm to their tips", check.along_mm), check.moved_along);
  for (std::size_t g = 0; g < check.gamma.size(); ++g)
    text += fmt::format("  gamma {:g} %, {:g} mm: {:.1f} % pass; with the grid moved {:.1f} %\n",
                        check.gamma[g].percent, check.gamma[g].mm, check.gamma[g].pass_percent,
                        check.gamma_shifted[g].pass_percent);
  if (!check.structures.empty()) {
    text += fmt::format("  {:<18}{:>8}", "file / recomputed", "cc");
    for (const FigureColumn& column : kFigures) text += fmt::format("{:>18}", column.title);
    text += "\n";
  }
  for (const FiguresOfBoth& s : check.structures) {
    text += fmt::format("  {:<18}{:>8.2f}", s.name, s.volume_cc);
    for (const FigureColumn& column : kFigures)
      text += fmt::format("{:>18}", of_both(s.file.*column.value, s.recomputed.*column.value));
    text += "\n";
  }
  for (const std::string& finding : check.findings) text += "  DISAGREES: " + finding + "\n";
  if (check.findings.empty())
    text += fmt::format("  agrees within {:g} %\n", check.settings.tolerance_percent);
  return text;
}

std::string to_json(const DoseCheck& check, const HdrPlan& plan) {
  Json json = {{"agrees", check.findings.empty()},
               {"findings", check.findings},
               {"source", tg43_source(plan.source).name},
               {"source_strength_u", plan.source_strength_u},
               {"dwell_positions",
                [&] {
                  std::size_t count = 0;
                  for (const PlanCatheter& c : plan.catheters) count += c.dwell_s.size();
                  return count;
                }()},
               {"dwells", plan.dwell_count()},
               {"total_s", plan.total_s()},
               {"total_reference_air_kerma_ugy", plan.source_strength_u * plan.total_s() / 3600},
               {"prescription_gy", plan.prescription_gy},
               {"least_gy", check.settings.least_gy},
               {"beside_mm", check.settings.beside_mm},
               {"tolerance_percent", check.settings.tolerance_percent},
               {"as_stored", json_of(check.as_stored)},
               {"shift_mm", json_of(check.shift_mm)},
               {"shifted", json_of(check.shifted)},
               {"dwells_moved_along_mm", check.along_mm},
               {"dwells_moved_along", json_of(check.moved_along)},
               {"file_to_recomputed", check.scale},
               {"gamma", json_of(check.gamma)},
               {"gamma_shifted", json_of(check.gamma_shifted)}};
  json["wrong_frames"] = check.wrong_frames;
  json["structures"] = Json::array();
  for (const FiguresOfBoth& s : check.structures)
    json["structures"].push_back({{"name", s.name},
                                  {"volume_cc", s.volume_cc},
                                  {"outside_percent", s.outside_percent},
                                  {"file", json_of(s.file)},
                                  {"recomputed", json_of(s.recomputed)}});
  json["sources"] = Json::array();
  for (const SourceFit& f : check.sources)
    json["sources"].push_back({{"source", tg43_source(f.model).name}, {"difference", json_of(f.difference)}});
  json["plan_points"] = Json::array();
  for (const DoseCheck::PointDose& p : check.plan_points)
    json["plan_points"].push_back(
        {{"position_mm", json_of(p.position)}, {"file_gy", p.file_gy}, {"recomputed_gy", p.recomputed_gy}});
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string to_html(const DoseCheck& check, const HdrPlan& plan, const TemplateGrid& grid,
                    const std::vector<Structure>& structures, const VoxelVolume& dose) {
  std::string page = kHead;
  page += "<h1>Dose check</h1>\n";
  page += fmt::format(
      "<p>{} catheters, {} dwells in {:.1f} s; {}, {:g} U; prescription {:g} Gy. Recomputed by AAPM TG-43U1 "
      "in "
      "water, sums of the line source.</p>\n",
      plan.catheters.size(), plan.dwell_count(), plan.total_s(),
      xml_escaped(std::string(tg43_source(plan.source).description)), plan.source_strength_u,
      plan.prescription_gy);
  if (check.findings.empty()) {
    page += fmt::format("<p class=\"verdict\">The doses agree within {:g} %.</p>\n",
                        check.settings.tolerance_percent);
  } else {
    page += "<p class=\"verdict\">The doses disagree:</p>\n<ul class=\"findings\">\n";
    for (const std::string& finding : check.findings) page += "<li>" + xml_escaped(finding) + "</li>\n";
    page += "</ul>\n";
  }
  page += fmt::format(
      "<h2>Points</h2>\n<p class=\"small\">Voxels with {:g} Gy or more, {:g} mm or more from every dwell; "
      "differences "
      "are recomputed / file − 1.</p>\n<table><tr><th></th><th>points</th><th>mean, %</th><th>root mean "
      "square, "
      "%</th><th>largest, %</th></tr>\n",
      check.settings.least_gy, check.settings.beside_mm);
  page += row_of("as stored", check.as_stored);
  page += row_of("file's grid moved " + shift_text(check.shift_mm), check.shifted);
  page += row_of(fmt::format("dwells moved {:+.2f} mm to their tips", check.along_mm), check.moved_along);
  page += "</table>\n<table><tr><th>gamma, local</th><th>as stored, % pass</th><th>moved, % pass</th></tr>\n";
  for (std::size_t g = 0; g < check.gamma.size(); ++g)
    page += fmt::format("<tr><td>{:g} %, {:g} mm</td><td>{:.1f}</td><td>{:.1f}</td></tr>\n",
                        check.gamma[g].percent, check.gamma[g].mm, check.gamma[g].pass_percent,
                        check.gamma_shifted[g].pass_percent);
  page += "</table>\n" + pictures(plan, grid, structures, dose);
  if (!check.structures.empty()) {
    page += "<h2>Structures</h2>\n<div class=\"scroll\"><table><tr><th>file / recomputed</th><th>cc</th>";
    for (const FigureColumn& column : kFigures) page += "<th>" + std::string(column.title) + "</th>";
    page += "</tr>\n";
    for (const FiguresOfBoth& s : check.structures) {
      page += "<tr><td>" + xml_escaped(s.name) + "</td>" + fmt::format("<td>{:.2f}</td>", s.volume_cc);
      for (const FigureColumn& column : kFigures)
        page += "<td>" + of_both(s.file.*column.value, s.recomputed.*column.value) + "</td>";
      page += "</tr>\n";
    }
    page += "</table></div>\n" + to_svg_element(dvh_chart_of(check));
  }
  page +=
      "<h2>Sources</h2>\n<table><tr><th>at the moved grid</th><th>points</th><th>mean, %</th><th>root mean "
      "square, %</th><th>largest, %</th></tr>\n";
  for (const SourceFit& f : check.sources)
    page += row_of(std::string(tg43_source(f.model).description), f.difference);
  page += "</table>\n";
  if (!check.plan_points.empty()) {
    page +=
        "<h2>Points of the plan</h2>\n<table><tr><th>x, y, z, mm</th><th>plan, Gy</th><th>recomputed, "
        "Gy</th></tr>\n";
    for (const DoseCheck::PointDose& p : check.plan_points)
      page += fmt::format("<tr><td>{}</td><td>{:.3f}</td><td>{:.3f}</td></tr>\n", shift_text(p.position),
                          p.file_gy, p.recomputed_gy);
    page += "</table>\n";
  }
  return page + "</body>\n</html>\n";
}

}  // namespace brachy
