#include "apps/score/report_charts.h"

#include <algorithm>
#include <array>

namespace brachy {
namespace {

// Distinguishable by colour-blind readers too.
constexpr std::array kStructureColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"};
constexpr double kHalfPage = 430;  // px
constexpr const char* kPlanned = "#888888";
constexpr const char* kFell = "#d55e00";
constexpr const char* kRest = "#0072b2";

void add(ChartLine& line, double x, double y) {
  line.x.push_back(x);
  line.y.push_back(y);
}

using Point = std::array<double, 2>;

/// Andrew's monotone chain; closed, the first point again at the end.
std::vector<Point> convex_hull(std::vector<Point> points) {
  std::ranges::sort(points);
  std::vector<Point> hull;
  const auto turns_left = [](const Point& a, const Point& b, const Point& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0;
  };
  const auto chain = [&](auto begin, auto end) {
    const std::size_t kept = hull.size();
    for (auto p = begin; p != end; ++p) {
      while (hull.size() >= kept + 2 && !turns_left(hull[hull.size() - 2], hull.back(), *p)) hull.pop_back();
      hull.push_back(*p);
    }
  };
  chain(points.begin(), points.end());
  if (!hull.empty()) hull.pop_back();
  chain(points.rbegin(), points.rend());
  return hull;
}

}  // namespace

Chart dvh_chart(const DoseScore& dose, const char* at_rest) {
  struct Style {
    const DoseStage* stage;
    const char* name;
    const char* dashes;
    double width_px;
  };
  const Style styles[] = {{&dose.plan, "planned", "7 4", 1.3},
                          {&dose.dropped, "as dropped", "1.5 3", 1.5},
                          {&dose.rest, at_rest, "", 1.8}};
  Chart chart{.title = "Dose-volume histograms",
              .x_label = "dose, % of the prescription",
              .y_label = "volume with at least that dose, %",
              .width_px = kHalfPage,
              .height_px = 330};
  for (std::size_t i = 0; i < dose.plan.structures.size(); ++i) {
    const std::string colour = kStructureColours[i % kStructureColours.size()];
    chart.lines.push_back(
        {.name = dose.plan.structures[i].name, .colour = colour, .width_px = 3});  // for the legend
    for (const Style& style : styles) {
      if (i >= style.stage->structures.size()) continue;
      ChartLine line{.colour = colour, .dashes = style.dashes, .width_px = style.width_px};
      const std::vector<float>& share = style.stage->structures[i].volume_share;
      for (std::size_t k = 0; k < share.size(); ++k) add(line, static_cast<double>(k), 100.0 * share[k]);
      chart.lines.push_back(std::move(line));
    }
  }
  for (const Style& style : styles)
    if (!style.stage->structures.empty())
      chart.lines.push_back(
          {.name = style.name, .colour = "#222222", .dashes = style.dashes, .width_px = style.width_px});
  return chart;
}

Chart displacement_chart(const SeedsScore& seeds, const Plan& plan, const TemplateGrid& grid,
                         const SurfaceMesh& prostate, int away) {
  const int across = 1 - away;
  constexpr double kGap = kNoNumber;
  ChartLine outline{.colour = "#bbbbbb", .width_px = 1};
  std::vector<Point> shadow;
  for (const Vec3& v : prostate.vertices) shadow.push_back({v[across], v.z()});
  for (const Point& p : convex_hull(std::move(shadow))) add(outline, p[0], p[1]);

  ChartLine to_fall{.colour = kFell, .width_px = 0.8, .arrows = true},
      to_rest{.colour = kRest, .width_px = 0.8, .arrows = true};
  ChartLine planned{.name = "plan", .colour = kPlanned, .width_px = 0, .dot_px = 2.2};
  ChartLine fell{.name = "fell", .colour = kFell, .width_px = 0, .dot_px = 1.6};
  ChartLine rest{.name = "at rest", .colour = kRest, .width_px = 0, .dot_px = 2.2};
  const auto arrow = [&](ChartLine& line, const Vec3& from, const Vec3& to) {
    add(line, from[across], from.z());
    add(line, to[across], to.z());
    add(line, kGap, kGap);
  };
  for (const PlannedSeed& seed : plan.seeds(grid)) add(planned, seed.position[across], seed.position.z());
  for (const SeedScore& s : seeds.by_position.placed) {
    arrow(to_fall, s.planned.position, s.seed.dropped);
    arrow(to_rest, s.seed.dropped, s.seed.rest);
  }
  const auto mark = [&](const Seed& seed) {
    add(fell, seed.dropped[across], seed.dropped.z());
    add(rest, seed.rest[across], seed.rest.z());
  };
  for (const SeedScore& s : seeds.by_position.placed) mark(s.seed);
  for (const Seed& seed : seeds.by_position.extra) mark(seed);
  return {.title = away == 1 ? "Seeds, seen along y" : "Seeds, seen along x",
          .x_label = across == 0 ? "x, mm" : "y, mm",
          .y_label = "z, mm",
          .lines = {outline, to_fall, to_rest, planned, fell, rest},
          .width_px = kHalfPage,
          .height_px = 350,
          .equal_scale = true};
}

// Minimum range of the axis across the needle, so that rounding is not drawn as an error.
constexpr double kLeastErrorMm = 0.5;

Chart error_chart(const SeedsScore& seeds) {
  ChartLine fell{.name = "fell", .colour = kFell, .width_px = 0, .dot_px = 2},
      rest{.name = "at rest", .colour = kRest, .width_px = 0, .dot_px = 2.6},
      moved{.colour = "#cccccc", .width_px = 0.6};
  for (const SeedScore& s : seeds.by_position.placed) {
    add(fell, s.dropped.axial_mm, s.dropped.lateral_mm);
    add(rest, s.rest.axial_mm, s.rest.lateral_mm);
    add(moved, s.dropped.axial_mm, s.dropped.lateral_mm);
    add(moved, s.rest.axial_mm, s.rest.lateral_mm);
    add(moved, kNoNumber, kNoNumber);
  }
  add(moved, 0, kLeastErrorMm);  // a single point draws no line
  return {.title = "Error of each seed against its plan",
          .x_label = "along the needle, mm (> 0: too deep)",
          .y_label = "across the needle, mm",
          .lines = {moved, fell, rest},
          .width_px = kHalfPage,
          .height_px = 280};
}

}  // namespace brachy
