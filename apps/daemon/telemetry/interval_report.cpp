#include "apps/daemon/telemetry/interval_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/reports/quantiles.h"

namespace brachy {

IntervalReport::Interval IntervalReport::next(double elapsed_s, const LoopStatistics& total,
                                              std::size_t clients) {
  const Interval interval{elapsed_s,
                          total.ticks - last_.ticks,
                          total.overruns - last_.overruns,
                          total.tick_ns.since(last_.tick_ns),
                          total.lateness_ns.since(last_.lateness_ns),
                          clients};
  last_ = total;
  return interval;
}

std::string to_text(const IntervalReport::Interval& i) {
  return fmt::format("{} ticks, {} missed, {} client{}; tick time, ms: {}; wake-up lateness, ms: {}", i.ticks,
                     i.overruns, i.clients, i.clients == 1 ? "" : "s", quantile_text(i.tick_ns),
                     quantile_text(i.lateness_ns));
}

std::string to_json(const IntervalReport::Interval& i) {
  return nlohmann::ordered_json{
      {"interval_end_s", i.elapsed_s},    {"ticks", i.ticks},
      {"overruns", i.overruns},           {"clients", i.clients},
      {"tick_ms", to_json_ms(i.tick_ns)}, {"lateness_ms", to_json_ms(i.lateness_ns)}}
      .dump();
}

}  // namespace brachy
