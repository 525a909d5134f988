#include "apps/lab/ticks/lag.h"

#include <functional>

#include "apps/command_line/options.h"
#include "apps/lab/program/report_files.h"
#include "apps/lab/program/study.h"
#include "apps/lab/program/wanted.h"
#include "apps/terminal/progress.h"

namespace brachy {

int lag(const LagOptions& options) {
  std::vector<LagScenario> scenarios = lag_scenarios();
  keep_wanted(scenarios, std::mem_fn(&LagScenario::name), options.scenarios, "--scenarios");
  std::vector<LagRow> rows;
  Progress progress("lag");
  for (const LagScenario& scenario : scenarios) {
    progress.show_step(rows.size(), scenarios.size(), scenario.name);
    if (options.daemon_files) write_lag_scenario(scenario, *options.daemon_files);
    rows.push_back(measure_lag(scenario));
  }
  progress.finish();
  write_report(options.json, to_json(rows), options.markdown, to_markdown(rows));
  return kExitOk;
}

}  // namespace brachy
