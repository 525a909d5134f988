#include "apps/daemon/telemetry/telemetry.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <utility>

#include "apps/daemon/control/controls.h"
#include "apps/daemon/control/scene_reload.h"
#include "apps/daemon/forces/force_link.h"
#include "apps/daemon/loops/simulation_runs.h"
#include "apps/daemon/service/service_watch.h"
#include "apps/daemon/telemetry/metrics_text.h"
#include "net/server/server.h"

namespace brachy {
namespace {

net::Quantiles quantiles_ms(const Histogram& ns) {
  const auto ms = [&](double q) { return 1e-6 * static_cast<double>(ns.quantile(q)); };
  return {ns.count(), ms(0.5), ms(0.99), ms(0.999), 1e-6 * static_cast<double>(ns.max())};
}

}  // namespace

Telemetry::Telemetry(EventLoop& loop, Sources sources)
    : from_(std::move(sources)),
      io_(loop),
      clock_(loop.clock()),
      start_time_s_(1e-9 * static_cast<double>(clock_.utc_ns())),
      report_timer_(loop.make_timer()) {}

const LoopStatistics& Telemetry::loop() {
  from_.loop.update();
  return from_.loop.value();
}

const LoopStatistics& Telemetry::control() {
  from_.control.update();
  return from_.control.value();
}

const UltrasoundStatistics& Telemetry::ultrasound() {
  from_.ultrasound.update();
  return from_.ultrasound.value();
}

net::StateMessage Telemetry::state() {
  const LoopStatistics& measured = loop();
  net::StateMessage m;
  m.ticks = measured.ticks;
  m.overruns = measured.overruns;
  m.control_overruns = control().overruns;
  m.tick_ms = quantiles_ms(measured.tick_ns);
  m.lateness_ms = quantiles_ms(measured.lateness_ns);
  m.latency_ms = quantiles_ms(measured.latency_ns);
  from_.forces.add_to(m);
  m.controls = from_.controls.state();
  return m;
}

std::string Telemetry::status() {
  const LoopStatistics& measured = loop();
  const std::size_t clients = from_.server.client_count();
  return fmt::format("{}:{}, {} client{}, {} ticks, {} missed", from_.server.address(), from_.server.port(),
                     clients, clients == 1 ? "" : "s", measured.ticks, measured.overruns);
}

net::DynamicPages Telemetry::pages() {
  net::DynamicPages pages;
  pages["/healthz"] = {net::DynamicPage::Access::kAnyone, [this] { return health(); }};
  pages["/metrics"] = {
      net::DynamicPage::Access::kViewer, [this] {
        return net::DynamicPage::Content{200, "text/plain; version=0.0.4; charset=utf-8", metrics()};
      }};
  return pages;
}

net::DynamicPage::Content Telemetry::health() {
  const std::string failure = from_.watch.failure();
  return {failure.empty() ? 200 : 503, "text/plain; charset=utf-8",
          (failure.empty() ? "ok" : failure) + "\n"};
}

std::string Telemetry::metrics() {
  const net::StateMessage state_message = from_.server.state();  // calls state(), which updates both readers
  return metrics_text({.simd = std::string(to_string(from_.runs.in_use().simulator.simd_target())),
                       .start_time_s = start_time_s_,
                       .loop = from_.loop.value(),
                       .control = from_.control.value(),
                       .ultrasound = ultrasound(),
                       .images_dropped = from_.server.images_dropped(),
                       .scene = from_.controls.scene(),
                       .state = state_message,
                       .clients = from_.server.role_counts(),
                       .igtl = from_.igtl(),
                       .connections_refused = from_.server.gate().refused(),
                       .connections_shed = from_.server.gate().shed(),
                       .wrong_tokens = from_.server.gate().wrong_tokens(),
                       .forces_replaced = from_.server.forces_replaced(),
                       .interventions = from_.forces.interventions(),
                       .seeds = seeds_,
                       .reloads_done = from_.reload.done(),
                       .reloads_refused = from_.reload.refused(),
                       .io_turns_ns = io_.turns_ns()});
}

void Telemetry::start_reports(double every_s, bool as_json) {
  report_start_ns_ = clock_.now_ns();
  report_period_ns_ = std::llround(every_s * 1e9);
  reports_as_json_ = as_json;
  report_later();
}

void Telemetry::report_later() {
  report_timer_->start(std::chrono::nanoseconds(report_period_ns_), [this] {
    const double elapsed_s = 1e-9 * static_cast<double>(clock_.now_ns() - report_start_ns_);
    const auto interval = interval_report_.next(elapsed_s, loop(), from_.server.client_count());
    if (reports_as_json_) {
      std::cout << to_json(interval) << std::endl;
    } else {
      spdlog::info("{}", to_text(interval));
    }
    report_later();
  });
}

void Telemetry::stop_reports() {
  report_timer_->cancel();
}

}  // namespace brachy
