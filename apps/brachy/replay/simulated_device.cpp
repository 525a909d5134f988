#include "apps/brachy/replay/simulated_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace brachy {

LoopSettings loop_settings(const SimulatedDeviceOptions& options) {
  LoopSettings s;
  s.device = {.mass_kg = options.mass_kg,
              .damping_n_s_per_mm = 1e-3 * options.damping_n_s_per_m,
              .hand_stiffness_n_per_mm = 1e-3 * options.hand_stiffness_n_per_m,
              .hand_damping_n_s_per_mm = 1e-3 * options.hand_damping_n_s_per_m,
              .rate_hz = options.rate_hz,
              .encoder_mm = 1e-3 * options.encoder_um};
  s.local_model = !options.simple_client;
  s.delay_s = 1e-3 * options.delay_ms;
  s.drop_share = options.drop_share;
  s.seed = options.seed;
  s.wire_hz = std::min(options.rate_hz, 1000.0);
  const StatedLimits stated{.max_force_n = options.max_force_n,
                            .damping_n_s_per_mm = s.device.damping_n_s_per_mm};
  s.limits = negotiate(stated, s.local_model
                                   ? ClosedLoop{1 / options.rate_hz, 0}
                                   : ClosedLoop{1 / s.wire_hz, wire_delay_s(2 * s.delay_s, 1 / s.wire_hz)});
  return s;
}

HandReport hand_report(const SimulatedDeviceOptions& options) {
  return HandReport(std::max(0.1, 5e-3 * options.encoder_um));
}

HandReport hold(const SimulatedDeviceOptions& options, const Trajectory& hand, double tick_period_s,
                std::uint64_t ticks, LoopSimulation simulation) {
  LoopSettings settings = loop_settings(options);
  settings.simulation_hz = 1 / tick_period_s;
  HandReport report = hand_report(options);
  std::uint64_t ticked = 0;
  SimulatedLoop loop(
      settings,
      [&](const NeedlePose& pose) {
        ++ticked;
        return simulation(pose);
      },
      hand.sample(hand.start_s()));
  const double period_s = 1 / options.rate_hz;
  while (ticked < ticks) {
    const double t_s = loop.time_s();
    const Vec3 force_n = loop.step(hand.sample(hand.start_s() + t_s + period_s));
    report.add(t_s, period_s, force_n, loop.device().tip() - loop.device().hand());
  }
  return report;
}

std::string with_hand(const std::string& json, const std::optional<SimulatedDeviceOptions>& device,
                      const HandReport& report) {
  if (!device) return json;
  auto whole = nlohmann::ordered_json::parse(json);
  nlohmann::ordered_json hand = {
      {"peak_force_n", report.peak_force_n()},
      {"largest_jump_n_per_ms", report.largest_jump_n_per_ms()},
      {"oscillated", report.oscillated()},
      {"oscillated_at_s", nullptr},
      {"max_stiffness_n_per_mm", loop_settings(*device).limits.max_stiffness_n_per_mm}};
  if (report.oscillated()) hand["oscillated_at_s"] = report.oscillated_at_s();
  whole["hand"] = std::move(hand);
  return whole.dump() + "\n";
}

std::string to_text(const std::optional<SimulatedDeviceOptions>& device, const HandReport& report) {
  if (!device) return "";
  return fmt::format("hand: peak force {:.2f} N, largest jump {:.3f} N/ms, {}; stiffness up to {:.3f} N/mm\n",
                     report.peak_force_n(), report.largest_jump_n_per_ms(),
                     report.oscillated() ? fmt::format("OSCILLATED at {:.2f} s", report.oscillated_at_s())
                                         : std::string("no oscillation"),
                     loop_settings(*device).limits.max_stiffness_n_per_mm);
}

}  // namespace brachy
