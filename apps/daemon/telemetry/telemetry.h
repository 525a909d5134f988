#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "apps/daemon/io/event_loop.h"
#include "apps/daemon/loops/loop_statistics.h"
#include "apps/daemon/loops/ultrasound_loop.h"
#include "apps/daemon/telemetry/interval_report.h"
#include "core/realtime/hand_over.h"
#include "net/http/dynamic_pages.h"
#include "net/wire/messages.h"

namespace brachy::net {
class Server;
}

namespace brachy {

class Controls;
class ForceLink;
struct IgtlFigures;
class SceneReload;
class ServiceWatch;
class SimulationRuns;

/// What the daemon reports about itself: STATE messages, the pages /metrics and /healthz, the status line for
/// the service manager, reports at intervals.
/// Threads: the io thread.
class Telemetry {
 public:
  /// All outlive the Telemetry, which is the only user of the readers.
  struct Sources {
    HandOver<LoopStatistics>::Reader& loop;
    HandOver<LoopStatistics>::Reader& control;  ///< stays empty without the control thread
    net::Server& server;
    SimulationRuns& runs;
    const ForceLink& forces;
    const Controls& controls;
    const SceneReload& reload;
    ServiceWatch& watch;
    std::function<IgtlFigures()> igtl;
    HandOver<UltrasoundStatistics>::Reader& ultrasound;
  };
  /// `loop` outlives this.
  Telemetry(EventLoop& loop, Sources sources);

  const LoopStatistics& loop();     ///< the newest
  const LoopStatistics& control();  ///< likewise
  const UltrasoundStatistics& ultrasound();

  net::StateMessage state();  ///< the simulation's part of a STATE
  std::string status();       ///< one line for the service manager
  net::DynamicPages pages();

  /// Reports every `every_s` (> 0) from here on: as JSON lines on standard output, else to the log.
  void start_reports(double every_s, bool as_json);
  void stop_reports();

  void set_seed_count(std::uint32_t seeds) { seeds_ = seeds; }  ///< of the newest snapshot

 private:
  net::DynamicPage::Content health();
  std::string metrics();
  void report_later();

  Sources from_;
  const EventLoop& io_;
  net::TimerClock& clock_;
  const double start_time_s_;  // wall clock, since 1970
  std::uint32_t seeds_ = 0;
  const std::unique_ptr<net::Timer> report_timer_;
  IntervalReport interval_report_;
  std::int64_t report_start_ns_ = 0, report_period_ns_ = 0;
  bool reports_as_json_ = false;
};

}  // namespace brachy
