#include "apps/lab/zwidth/zwidth.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/command_line/options.h"
#include "apps/lab/program/report_files.h"
#include "apps/lab/program/study.h"
#include "apps/terminal/progress.h"

namespace brachy {

int zwidth(const ZWidthOptions& options) {
  DeviceDynamicsSettings device;
  device.mass_kg = options.mass_kg;
  device.damping_n_s_per_mm = options.damping_n_s_per_mm;
  std::vector<ZWidthPoint> points;
  const std::vector<ZWidthCase> cases = zwidth_cases(options.quick);
  Progress progress("zwidth");
  for (const ZWidthCase& loop : cases) {
    progress.show_step(points.size(), cases.size(), fmt::format("{:g} Hz", loop.rate_hz));
    points.push_back(measure_zwidth(loop, device));
  }
  progress.finish();

  const bool calm_under =
      std::ranges::all_of(points, [](const auto& p) { return p.greatest_calm_share >= 1; });
  const bool rings_over = std::ranges::all_of(
      points, [](const auto& p) { return p.least_ringing_share > 0 && p.least_ringing_share <= 1.3; });
  const std::string text =
      to_markdown(points) +
      fmt::format(
          "\nA free mass of {:g} g, b = {:g} N·s/m. {} under the negotiated limit; {} from "
          "1.3 of it on.\n",
          1e3 * device.mass_kg, 1e3 * device.damping_n_s_per_mm,
          calm_under ? "Every case is calm" : "NOT every case is calm",
          rings_over ? "every case rings" : "NOT every case rings");
  write_report(options.json, to_json(points, device), options.markdown, text);
  return calm_under ? kExitOk : kExitFailed;
}

}  // namespace brachy
