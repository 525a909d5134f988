#include "apps/forces/force_chart.h"

#include <limits>

#include "apps/charts/svg_chart.h"

namespace brachy {
namespace {

struct Part {
  const char* name;
  const char* colour;  // distinguishable by colour-blind readers; the sum, below its parts, is wider
  double width_px;
  double NeedleForces::*value;
};
constexpr Part kParts[] = {{"axial", "#222222", 3.2, &NeedleForces::axial_n},
                           {"cutting", "#d55e00", 1.5, &NeedleForces::cutting_n},
                           {"friction", "#0072b2", 1.5, &NeedleForces::friction_n}};

/// The part's samples in one direction, the others as gaps; at a turn also the last one of the other direction, so that
/// the lines meet.
ChartLine line_of(const std::vector<ForceSample>& samples, const std::vector<bool>& out, bool way_out,
                  const Part& part, double ForceSample::*x) {
  constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
  ChartLine line{.name = std::string(part.name) + (way_out ? ", out" : ", in"),
                 .colour = part.colour,
                 .dashes = way_out ? "6 3" : "",
                 .width_px = part.width_px};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const bool belongs = out[i] == way_out || (i + 1 < samples.size() && out[i + 1] == way_out);
    line.x.push_back(samples[i].*x);
    line.y.push_back(belongs ? samples[i].forces.*part.value : kGap);
  }
  return line;
}

}  // namespace

std::vector<bool> on_the_way_out(const std::vector<ForceSample>& samples, double least_mm) {
  std::vector<bool> out(samples.size(), false);
  std::size_t turn = 0;  // the farthest sample in the present direction
  bool way_out = false;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double ahead = (way_out ? -1 : 1) * (samples[i].depth_mm - samples[turn].depth_mm);
    if (ahead >= 0) turn = i;
    if (ahead <= -least_mm) {
      way_out = !way_out;
      for (std::size_t j = turn + 1; j < i; ++j) out[j] = way_out;
      turn = i;
    }
    out[i] = way_out;
  }
  // A tip on the capsule has no depth yet that shows its direction; it is about to go in.
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (samples[i].state == ContactState::kTouching) out[i] = false;
  return out;
}

std::string force_chart(const std::vector<ForceSample>& samples, const std::string& title) {
  const std::vector<bool> out = on_the_way_out(samples);
  const char* force = "force on the needle, N (> 0 pushes it out)";
  Chart depth{title, "insertion depth, mm", force, {}}, time{"", "time, s", force, {}};
  for (const Part& part : kParts) {
    for (bool way_out : {false, true}) {
      depth.lines.push_back(line_of(samples, out, way_out, part, &ForceSample::depth_mm));
      time.lines.push_back(line_of(samples, out, way_out, part, &ForceSample::t_s));
      time.lines.back().name.clear();
    }
  }
  return to_svg({depth, time});
}

}  // namespace brachy
