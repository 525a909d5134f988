#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/forces/force_chart.h"
#include "apps/forces/force_summary.h"
#include "core/base/error.h"

namespace brachy {
namespace {

struct PlotForceOptions {
  std::filesystem::path log;
  std::optional<std::filesystem::path> out;  ///< none: the log's name with .svg
  std::optional<std::uint32_t> needle;       ///< none: the first one in the log
  bool json = false, force = false;
};

std::string listed(const std::set<std::uint32_t>& needles) {
  std::string text;
  for (std::uint32_t id : needles) text += (text.empty() ? "" : ", ") + std::to_string(id);
  return text;
}

std::filesystem::path chart_file(const PlotForceOptions& options) {
  std::filesystem::path out = options.log;
  out.replace_extension(".svg");
  out = options.out.value_or(out);
  std::error_code ignored;
  if (std::filesystem::equivalent(out, options.log, ignored))
    throw UserError(out.string() + ": is the log itself; give the chart another name with --out");
  return out;
}

int run(const PlotForceOptions& options) {
  const std::filesystem::path out = chart_file(options);
  check_output(out, options.force);
  const std::vector<ForceSample> log = load_force_log(options.log);
  std::set<std::uint32_t> needles;
  for (const ForceSample& sample : log) needles.insert(sample.needle);
  const std::uint32_t needle = options.needle.value_or(*needles.begin());
  if (!needles.contains(needle))
    throw UserError(fmt::format("{}: has no rows of needle {}; it has {}", options.log.string(), needle,
                                listed(needles)));

  std::vector<ForceSample> samples;
  ForcePeaks peaks;
  for (const ForceSample& sample : log) {
    if (sample.needle != needle) continue;
    samples.push_back(sample);
    peaks.add(sample);
  }
  const std::string name = options.log.filename().string();
  write_text(out,
             force_chart(samples, needles.size() == 1 ? name : fmt::format("{}, needle {}", name, needle)),
             options.force);

  const double duration_s = samples.back().t_s - samples.front().t_s;
  if (options.json) {
    const nlohmann::ordered_json json = {{"out", out.string()},
                                         {"needle", needle},
                                         {"needles", needles},
                                         {"rows", samples.size()},
                                         {"duration_s", duration_s},
                                         {"max_depth_mm", peaks.depth_mm()},
                                         {"peak_out_n", peaks.out_n()},
                                         {"peak_in_n", peaks.in_n()},
                                         {"peak_lateral_n", peaks.lateral_n()},
                                         {"puncture_n", peaks.puncture_n()},
                                         {"axial_at_deepest_n", peaks.deepest().forces.axial_n},
                                         {"cutting_at_deepest_n", peaks.deepest().forces.cutting_n},
                                         {"friction_at_deepest_n", peaks.deepest().forces.friction_n},
                                         {"min_det", peaks.min_det()},
                                         {"max_tip_deflection_mm", peaks.tip_deflection_mm()}};
    std::cout << json.dump() << "\n";
    return kExitOk;
  }
  std::cout << fmt::format(
      "{}: {} rows of needle {} over {:.1f} s, to {:.1f} mm; at most {:.2f} N out, {:.2f} N in{}\n",
      out.string(), samples.size(), needle, duration_s, peaks.depth_mm(), peaks.out_n(), peaks.in_n(),
      needles.size() > 1 ? "; needles in the log: " + listed(needles) + " (--needle)" : "");
  return kExitOk;
}

void declare(OptionList& list, PlotForceOptions& options) {
  list.add("log", options.log, "CSV of `brachy replay --offline --log` or `brachy record`").required();
  list.add_output("--out", options.out, "SVG to write; default: the log's name with .svg");
  list.add("--needle", options.needle, "default: the first one in the log").range(0, 15);
  list.add_force(options.force);
  list.add_flag("--json", options.json, "print the log's extent and its peaks as JSON");
}

}  // namespace

Tool plot_force_tool() {
  return make_tool<PlotForceOptions>("plot-force", "Draw a force log: force against depth and against time.",
                                     R"(Examples:
  brachy replay config/insertion_5mm_s.csv --offline --log force.csv; brachy plot-force force.csv
  brachy plot-force out/run1/forces.csv --needle 2 --out needle2.svg --json
Solid lines: on the way in; dashed ones: on the way out. Axial forces above 0 push the needle out.
Exit codes: 0 done, 2 bad input.)",
                                     declare, run);
}

}  // namespace brachy
