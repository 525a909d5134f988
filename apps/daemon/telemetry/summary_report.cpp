#include "apps/daemon/telemetry/summary_report.h"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>

#include "apps/reports/certificate_report.h"
#include "apps/reports/quantiles.h"
#include "core/models/scalar_kernel/scalar_kernel_field.h"

namespace brachy {
namespace {

double rate(std::uint64_t count, double elapsed_s) {
  return elapsed_s > 0 ? static_cast<double>(count) / elapsed_s : 0;
}

/// One line of interventions; empty if there were none.
std::string safety_text(const DaemonSummary& s) {
  std::string text;
  for (std::size_t i = 0; i < kInterventions; ++i)
    if (s.interventions[i])
      text += fmt::format("{} {} {}", text.empty() ? "" : ",", s.interventions[i], kInterventionNames[i]);
  return text.empty() ? "" : "  safety:" + text + "\n";
}

/// Empty without seeds and session.
std::string seed_text(const DaemonSummary& s) {
  std::string text;
  if (s.seeds_dropped || s.drops_refused)
    text += fmt::format("  seeds: {} dropped, {} not; from the drop to the DVH, ms: {}\n", s.seeds_dropped,
                        s.drops_refused, quantile_text(s.dose.drop_to_dvh_ns));
  if (!s.session.empty()) text += "  session: " + s.session + "\n";
  return text;
}

std::uint64_t ticks_of(const DaemonSummary& s, Evaluation e) {
  return s.evaluations[static_cast<std::size_t>(e)];
}

}  // namespace

std::string to_text(const DaemonSummary& s) {
  const LoopStatistics& loop = s.loop;
  std::string text = fmt::format(
      "brachyd: {:.1f} s, {} ticks ({:.1f} Hz), {} missed ({:.3f} %), {} snapshots ({:.1f} Hz)\n"
      "  tick time, ms:        {}\n"
      "  wake-up lateness, ms: {}\n",
      s.elapsed_s, loop.ticks, rate(loop.ticks, s.elapsed_s), loop.overruns,
      loop.ticks
          ? 100.0 * static_cast<double>(loop.overruns) / static_cast<double>(loop.ticks + loop.overruns)
          : 0.0,
      s.snapshots, rate(s.snapshots, s.elapsed_s), quantile_text(loop.tick_ns),
      quantile_text(loop.lateness_ns));
  if (loop.latency_ns.count())
    text += fmt::format("  pose to publish, ms:  {}\n", quantile_text(loop.latency_ns));
  if (s.control.ticks)
    text += fmt::format("  idle control thread:  {} missed, lateness ms {}\n", s.control.overruns,
                        quantile_text(s.control.lateness_ns));
  text += fmt::format(
      "  poses: {} accepted, {} refused; largest displacement {:.2f} mm, at most {} points moved in a tick\n",
      s.poses_accepted, s.poses_refused, loop.max_displacement_mm, loop.moved_vertices);
  if (loop.max_tip_deflection_mm > 0)
    text += fmt::format("  bent needles: tip deflected by at most {:.2f} mm\n", loop.max_tip_deflection_mm);
  text += fmt::format("  fields: {} idle, {} direct, {} mixed, {} condensed, on {}\n",
                      ticks_of(s, Evaluation::kIdle), ticks_of(s, Evaluation::kDirect),
                      ticks_of(s, Evaluation::kMixed), ticks_of(s, Evaluation::kCondensed), s.simd);
  if (s.ultrasound.images + s.ultrasound.held > 0)
    text +=
        fmt::format("  ultrasound: {} images, {} held, {} periods missed; ms an image: {}; ms a field: {}\n",
                    s.ultrasound.images, s.ultrasound.held, s.ultrasound.overruns,
                    quantile_text(s.ultrasound.image_ns), quantile_text(s.ultrasound.field_ns));
  text += to_text("ticks", loop.certificates);
  text += safety_text(s);
  text += seed_text(s);
  if (s.wrong_tokens) text += fmt::format("  wrong tokens: {}\n", s.wrong_tokens);
  if (s.broker)
    text += fmt::format(
        "  broker: {} messages, {:.1f} MB published, {} dropped; connected {} times, republished {} times\n",
        s.broker->messages, 1e-6 * static_cast<double>(s.broker->bytes), s.broker->dropped,
        s.broker->connections, s.broker->epochs);
  text += "  " + s.realtime + "\n";
  return text;
}

std::string to_json(const DaemonSummary& s) {
  nlohmann::ordered_json json = {
      {"elapsed_s", s.elapsed_s},
      {"ticks", s.loop.ticks},
      {"overruns", s.loop.overruns},
      {"longest_overrun", s.loop.longest_overrun},
      {"control_ticks", s.control.ticks},
      {"control_overruns", s.control.overruns},
      {"control_longest_overrun", s.control.longest_overrun},
      {"sim_hz", rate(s.loop.ticks, s.elapsed_s)},
      {"snapshots", s.snapshots},
      {"snapshots_hz", rate(s.snapshots, s.elapsed_s)},
      {"tick_ms", to_json_ms(s.loop.tick_ns)},
      {"lateness_ms", to_json_ms(s.loop.lateness_ns)},
      {"latency_ms", to_json_ms(s.loop.latency_ns)},
      {"max_disp_mm", s.loop.max_displacement_mm},
      {"moved", s.loop.moved_vertices},
      {"simd", s.simd},
      {"ticks_idle", ticks_of(s, Evaluation::kIdle)},
      {"ticks_direct", ticks_of(s, Evaluation::kDirect)},
      {"ticks_mixed", ticks_of(s, Evaluation::kMixed)},
      {"ticks_condensed", ticks_of(s, Evaluation::kCondensed)},
      {"poses_accepted", s.poses_accepted},
      {"poses_refused", s.poses_refused},
      {"realtime", s.realtime},
  };
  for (std::size_t i = 0; i < kInterventions; ++i) json["safety"][kInterventionNames[i]] = s.interventions[i];
  json["wrong_tokens"] = s.wrong_tokens;
  json["forces_replaced"] = s.forces_replaced;
  if (s.broker)
    json["broker"] = {{"connections", s.broker->connections},
                      {"epochs", s.broker->epochs},
                      {"messages", s.broker->messages},
                      {"bytes", s.broker->bytes},
                      {"dropped", s.broker->dropped}};
  json["seeds_dropped"] = s.seeds_dropped;
  json["drops_refused"] = s.drops_refused;
  json["drop_to_dvh_ms"] = to_json_ms(s.dose.drop_to_dvh_ns);
  json["images"] = s.ultrasound.images;
  json["images_held"] = s.ultrasound.held;
  json["image_periods_missed"] = s.ultrasound.overruns;
  json["image_ms"] = to_json_ms(s.ultrasound.image_ns);
  json["image_field_ms"] = to_json_ms(s.ultrasound.field_ns);
  add_to_json(json, "ticks", s.loop.certificates);
  json["max_tip_deflection_mm"] = s.loop.max_tip_deflection_mm;
  return json.dump();
}

}  // namespace brachy
