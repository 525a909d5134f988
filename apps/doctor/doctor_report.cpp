#include "apps/doctor/doctor_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/doctor/work_scale.h"
#include "apps/reports/certificate_report.h"
#include "apps/reports/quantiles.h"

namespace brachy {
namespace {

std::string model_text(const Trial& t) {
  if (t.support_radius_mm > 0) return fmt::format("{} (support {:g} mm)", t.kernel, t.support_radius_mm);
  return t.kernel;
}

std::string trial_text(const Trial& t) {
  const TrialResult& r = t.result;
  return fmt::format("{} at {:g} Hz: a tick takes {:.2f} ms of {:.1f} (p99), {} of {} missed{}",
                     model_text(t), t.deformation_hz, r.tick_p99_ms, t.budget_ms(), r.missed,
                     r.ticks + r.missed, late_text(r.late, r.max_lag_mm));
}

/// If an idle thread is woken late too, the machine is part of the cause.
std::string blame(const Machine& m) {
  const double late_ms = 1e-6 * static_cast<double>(m.lateness_ns.quantile(0.99)),
               period_ms = 1e3 * m.period_s;
  if (late_ms < 0.25 * period_ms) return {};
  return fmt::format(" This machine wakes even an idle thread {:.1f} ms late (p99): {}.", late_ms,
                     m.is_measured_with_fifo || !m.fifo_refusal.empty()
                         ? "free it of other work"
                         : "free it of other work, or set [realtime] fifo_priority");
}

/// A trial without which the answer would be another, and that says nothing; null: there is none.
const Trial* busy_trial(const Diagnosis& d) {
  if (d.fit) return nullptr;
  const auto busy = std::ranges::find_if(d.tried, [](const Trial& t) { return is_busy(t.result); });
  return busy == d.tried.end() ? nullptr : &*busy;
}

std::string answer(const Machine& m, const Diagnosis& d) {
  const Trial& own = d.tried.front();
  if (const Trial* busy = busy_trial(d))
    return fmt::format(
        "This machine is busy: cannot judge. Even an idle thread missed {} of {} deadlines: end other work, "
        "and ask "
        "again. {}.{}",
        busy->result.control_missed, busy->result.control_ticks + busy->result.control_missed,
        trial_text(*busy), blame(m));
  if (d.fit == std::size_t{0}) return fmt::format("The scene fits. {}.", trial_text(own));
  const std::string heavy =
      fmt::format("The scene is too heavy for this machine. {}.{}", trial_text(own), blame(m));
  if (!d.fit)
    return heavy + " No model and rate that were tried fit: reduce tissue.points, or use a faster machine.";
  return heavy + fmt::format(" This fits: {}.", trial_text(d.tried[*d.fit]));
}

/// The keys in which the trial differs from the scene, as TOML.
std::string keys_of(const Trial& t, const Trial& own) {
  std::string keys;
  const bool is_other_support = t.support_radius_mm > 0 && t.support_radius_mm != own.support_radius_mm;
  if (t.kernel != own.kernel || is_other_support)
    keys += fmt::format("    [model]\n    kernel = \"{}\"\n", t.kernel);
  if (is_other_support) keys += fmt::format("    support_radius_mm = {:g}\n", t.support_radius_mm);
  if (t.deformation_hz != own.deformation_hz)
    keys += fmt::format("    [rates]\n    deformation_hz = {:g}\n", t.deformation_hz);
  return keys;
}

nlohmann::ordered_json json_of(const Trial& t) {
  const TrialResult& r = t.result;
  nlohmann::ordered_json json = {{"kernel", t.kernel}};
  if (t.support_radius_mm > 0) json["support_radius_mm"] = t.support_radius_mm;
  json["deformation_hz"] = t.deformation_hz;
  json["budget_ms"] = t.budget_ms();
  json["tick_ms"] = {{"p50", r.tick_p50_ms}, {"p99", r.tick_p99_ms}, {"max", r.tick_max_ms}};
  json["lateness_p99_ms"] = r.lateness_p99_ms;
  json["ticks"] = r.ticks;
  json["missed"] = r.missed;
  json["ticks_late"] = r.late;
  json["max_lag_mm"] = r.max_lag_mm;
  json["control_ticks"] = r.control_ticks;
  json["control_missed"] = r.control_missed;
  if (t.charted_error_mm) json["charted_error_mm"] = *t.charted_error_mm;
  json["fits"] = fits(t) && !is_busy(t.result);
  return json;
}

std::string granted(const std::string& refusal) {
  return refusal.empty() ? "granted" : "refused (" + refusal + ")";
}

std::string machine_text(const Machine& m) {
  std::string text = fmt::format("machine: {}{}{} core{}, {}\n", m.cpu, m.cpu.empty() ? "" : ", ", m.cores,
                                 m.cores == 1 ? "" : "s", m.simd);
  text += fmt::format("  SCHED_FIFO {}: {}{}\n", m.fifo_priority, granted(m.fifo_refusal),
                      m.fifo_refusal.empty() && !m.is_measured_with_fifo
                          ? ", but not requested: set [realtime] fifo_priority"
                          : "");
  text += fmt::format("  memory lock: {}\n", granted(m.memory_refusal));
  text += fmt::format("  wake-up lateness over {:g} s at {:g} Hz{}, ms: {}\n", m.seconds, 1 / m.period_s,
                      m.is_measured_with_fifo ? " with SCHED_FIFO" : "", quantile_text(m.lateness_ns));
  if (!m.governor.empty()) text += fmt::format("  governor: {}\n", m.governor);
  if (m.stolen_share) text += fmt::format("  taken by the host meanwhile: {:.2f} %\n", 100 * *m.stolen_share);
  return text;
}

}  // namespace

std::string to_text(const Machine& machine, const Scene& scene, const Diagnosis& d) {
  std::string text = answer(machine, d) + "\n";
  if (d.fit.value_or(0) > 0) text += "  in the scene:\n" + keys_of(d.tried[*d.fit], d.tried.front());
  text += machine_text(machine);
  text += fmt::format("scene: {}, {} points, {} needle{}\n", scene.name, scene.tissue.points,
                      scene.needle.count, scene.needle.count == 1 ? "" : "s");
  for (const Trial& t : d.tried) {
    text += "  " + trial_text(t);
    if (t.charted_error_mm) text += fmt::format("; charted error {:.2f} mm", *t.charted_error_mm);
    text += is_busy(t.result) ? "; busy\n" : fits(t) ? "; fits\n" : "\n";
  }
  text += fmt::format("a tick's work costs {:.2f} times what is stored; for scenes of this machine alone:\n",
                      machine.work_scale);
  return text + work_costs_toml(WorkCosts{}.slower_by(machine.work_scale), "    ");
}

std::string to_json(const Machine& m, const Scene& scene, const Diagnosis& d) {
  const auto refusal = [](const std::string& why) -> nlohmann::ordered_json {
    return {{"granted", why.empty()}, {"refusal", why}};
  };
  nlohmann::ordered_json json = {
      {"fits", d.fit == std::size_t{0}}, {"busy", busy_trial(d) != nullptr}, {"answer", answer(m, d)}};
  json["take"] = d.fit ? json_of(d.tried[*d.fit]) : nlohmann::ordered_json();
  nlohmann::ordered_json& machine = json["machine"];
  machine["cores"] = m.cores;
  machine["cpu"] = m.cpu;
  machine["simd"] = m.simd;
  machine["simd_targets"] = m.simd_targets;
  machine["sched_fifo"] = refusal(m.fifo_refusal);
  machine["sched_fifo"]["priority"] = m.fifo_priority;
  machine["memory_lock"] = refusal(m.memory_refusal);
  machine["wakeup_lateness_ms"] = to_json_ms(m.lateness_ns);
  machine["wakeup_lateness_with_fifo"] = m.is_measured_with_fifo;
  machine["seconds"] = m.seconds;
  machine["governor"] = m.governor.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(m.governor);
  machine["stolen_share"] =
      m.stolen_share ? nlohmann::ordered_json(*m.stolen_share) : nlohmann::ordered_json();
  machine["work_scale"] = m.work_scale;
  json["scene"] = {{"name", scene.name},
                   {"points", scene.tissue.points},
                   {"needles", scene.needle.count},
                   {"deformation_hz", scene.rates.deformation_hz}};
  for (const Trial& t : d.tried) json["tried"].push_back(json_of(t));
  return json.dump();
}

}  // namespace brachy
