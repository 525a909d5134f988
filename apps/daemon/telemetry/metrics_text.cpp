#include "apps/daemon/telemetry/metrics_text.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>
#include <cmath>

#include <filesystem>
#include <fstream>

#include "apps/daemon/telemetry/exposition.h"
#include "core/base/version.h"
#include "haptics/devices/pose_guard.h"

namespace brachy {
namespace {

/// The label of a refusal code: a PoseStatus, or one of the server's own codes (0xFF00 and above).
std::string reason_of(std::uint16_t code) {
  switch (code) {
    case static_cast<std::uint16_t>(PoseStatus::kNotFinite):
      return "not_finite";
    case static_cast<std::uint16_t>(PoseStatus::kNotRigid):
      return "not_rigid";
    case static_cast<std::uint16_t>(PoseStatus::kStale):
      return "stale";
    case static_cast<std::uint16_t>(PoseStatus::kOutOfOrder):
      return "out_of_order";
    case static_cast<std::uint16_t>(PoseStatus::kOutOfRange):
      return "out_of_range";
    case static_cast<std::uint16_t>(PoseStatus::kNotAttached):
      return "not_attached";
    case static_cast<std::uint16_t>(PoseStatus::kMetres):
      return "metres";
    case static_cast<std::uint16_t>(PoseStatus::kQuaternionOrder):
      return "quaternion_order";
    case net::kRefusedRate:
      return "rate";
    case net::kRefusedNeedle:
      return "other_needle";
    default:
      return fmt::format("code_{}", code);
  }
}

void add_loop(Exposition& out, const DaemonMetrics& m) {
  const LoopStatistics& loop = m.loop;
  out.counter("brachy_ticks_total", static_cast<double>(loop.ticks), "Ticks of the deformation loop.");
  out.counter("brachy_ticks_missed_total", static_cast<double>(loop.overruns),
              "Deadlines that the deformation loop missed; it skips them.");
  if (m.control.ticks > 0)
    out.counter("brachy_control_ticks_missed_total", static_cast<double>(m.control.overruns),
                "Deadlines that an idle thread missed, because of the machine.");
  out.gauge("brachy_tick_period_seconds", m.scene.period_s(),
            "Period of the deformation loop, the limit of a tick's duration.");
  out.histogram("brachy_tick_seconds", loop.tick_ns, "Duration of a tick, from waking up to publishing.");
  out.histogram("brachy_wakeup_lateness_seconds", loop.lateness_ns,
                "How late the deformation loop woke up for a tick.");
  out.histogram("brachy_pose_to_mesh_seconds", loop.latency_ns,
                "From the arrival of a pose to the mesh that follows it.");
  out.family("brachy_ticks_by_verdict_total", "counter",
             "Ticks by the verdict of their injectivity certificate.");
  const CertificateTally& tally = loop.certificates;
  out.sample(static_cast<double>(tally.injective), {{"verdict", "injective"}});
  out.sample(static_cast<double>(tally.folded), {{"verdict", "folded"}});
  out.sample(static_cast<double>(tally.unknown), {{"verdict", "unknown"}});
  out.counter("brachy_ticks_late_total", static_cast<double>(tally.late),
              "Ticks that show tissue of an earlier one.");
  out.gauge("brachy_lag_mm_max", std::isnan(tally.max_lag_mm) ? 0 : tally.max_lag_mm,
            "By how much tissue that was shown lagged behind its landmarks since the start, at most.");
}

void add_ultrasound(Exposition& out, const DaemonMetrics& m) {
  const UltrasoundStatistics& u = m.ultrasound;
  out.counter("brachy_images_total", static_cast<double>(u.images), "Ultrasound images made.");
  out.counter("brachy_images_held_total", static_cast<double>(u.held),
              "Times the last ultrasound image stood, because the field folded or was not solved.");
  out.counter(
      "brachy_images_dropped_total", static_cast<double>(m.images_dropped),
      "Ultrasound images replaced by a newer one before a slow client received them, over all clients.");
  out.counter("brachy_image_periods_missed_total", static_cast<double>(u.overruns),
              "Periods of the ultrasound thread that passed while it was busy.");
  out.histogram("brachy_image_seconds", u.image_ns, "Duration of one ultrasound image.");
}

void add_clients(Exposition& out, const DaemonMetrics& m) {
  out.family("brachy_clients", "gauge", "Connected clients, by role.");
  out.sample(static_cast<double>(m.clients.viewers), {{"role", "viewer"}});
  out.sample(static_cast<double>(m.clients.devices), {{"role", "device"}});
  out.sample(static_cast<double>(m.clients.operators), {{"role", "operator"}});
  out.gauge("brachy_igtl_clients", static_cast<double>(m.igtl.clients), "Connected OpenIGTLink clients.");
  out.counter("brachy_igtl_lost_total", static_cast<double>(m.igtl.lost),
              "OpenIGTLink messages dropped, skipped, ignored or replaced by newer ones.");
  out.counter("brachy_connections_refused_total", static_cast<double>(m.connections_refused),
              "Connections refused for lack of a free slot.");
  out.counter("brachy_connections_shed_total", static_cast<double>(m.connections_shed),
              "Connections closed before HELLO because newer ones needed their place.");
  out.counter("brachy_wrong_tokens_total", static_cast<double>(m.wrong_tokens),
              "Invalid tokens presented by clients.");
  out.counter("brachy_snapshots_total", static_cast<double>(m.state.snapshots),
              "Snapshots published to viewers.");
  out.counter("brachy_snapshots_dropped_total", static_cast<double>(m.state.snapshots_dropped),
              "Snapshots replaced by a newer one before a slow client received them, over all clients.");
  out.counter("brachy_events_dropped_total", static_cast<double>(m.state.events_dropped),
              "Events that a client did not get because it was behind, over all clients.");
  out.counter("brachy_poses_accepted_total", static_cast<double>(m.state.poses_accepted),
              "Device poses accepted.");
  out.family("brachy_poses_refused_total", "counter", "Device poses refused, by reason.");
  for (const net::PoseRefusals& refusals : m.state.refusals)
    out.sample(static_cast<double>(refusals.count), {{"reason", reason_of(refusals.code)}});
  out.counter("brachy_forces_replaced_total", static_cast<double>(m.forces_replaced),
              "Force messages replaced by a newer one before they were sent.");
  out.family("brachy_safety_interventions_total", "counter", "Interventions of the force gates, by kind.");
  for (std::size_t i = 0; i < kInterventions; ++i)
    out.sample(static_cast<double>(m.interventions[i]), {{"kind", kInterventionNames[i]}});
}

// Named as by Prometheus' client libraries.
void add_process(Exposition& out, double start_time_s) {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  double total_pages = 0, resident_pages = 0;
  std::ifstream("/proc/self/statm") >> total_pages >> resident_pages;
  const auto page_bytes = static_cast<double>(sysconf(_SC_PAGESIZE));
  std::error_code error;
  const auto descriptors = std::distance(std::filesystem::directory_iterator("/proc/self/fd", error),
                                         std::filesystem::directory_iterator());
  out.gauge("process_start_time_seconds", start_time_s, "When the daemon started, in seconds since 1970.");
  out.counter("process_cpu_seconds_total", seconds(used.ru_utime) + seconds(used.ru_stime),
              "Processor time of all threads.");
  out.gauge("process_resident_memory_bytes", resident_pages * page_bytes, "Resident memory.");
  out.gauge("process_virtual_memory_bytes", total_pages * page_bytes, "Address space.");
  out.gauge("process_open_fds", static_cast<double>(descriptors), "Open file descriptors.");
}

}  // namespace

std::string metrics_text(const DaemonMetrics& m) {
  Exposition out;
  out.family("brachy_build_info", "gauge", "Always 1; the labels describe the build.");
  out.sample(1,
             {{"version", version()}, {"protocol", std::to_string(net::kProtocolVersion)}, {"simd", m.simd}});
  out.family("brachy_model_info", "gauge", "Always 1; the labels describe the model in use.");
  out.sample(1, {{"kernel", m.scene.model.kernel},
                 {"support_radius_mm", fmt::format("{:g}", m.scene.model.support_radius_mm)}});
  add_loop(out, m);
  add_ultrasound(out, m);
  add_clients(out, m);
  out.gauge("brachy_seeds", m.seeds, "Seeds in the tissue.");
  out.family("brachy_scene_reloads_total", "counter", "Reloads of the scene file, by result.");
  out.sample(static_cast<double>(m.reloads_done), {{"result", "done"}});
  out.sample(static_cast<double>(m.reloads_refused), {{"result", "refused"}});
  out.histogram("brachy_io_turn_seconds", m.io_turns_ns,
                "Processor time of one handler of the io thread, which serves all sockets.");
  out.gauge("brachy_io_turn_seconds_max", 1e-9 * static_cast<double>(m.io_turns_ns.max()),
            "The longest of them since the start; none should take more than 0.001.");
  add_process(out, m.start_time_s);
  return out.take();
}

}  // namespace brachy
