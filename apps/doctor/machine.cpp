#include "apps/doctor/machine.h"

#include <sched.h>

#include <array>
#include <cmath>
#include <fstream>

#include "core/base/simd/simd_target.h"
#include "core/realtime/deadline.h"

namespace brachy {
namespace {

constexpr int kUsualPriority = 80;  // requested if the scene requests none

std::string cpu_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name"))
      if (const auto at = line.find(": "); at != std::string::npos) return line.substr(at + 2);
  return {};
}

unsigned usable_cores() {
  cpu_set_t cores;
  return sched_getaffinity(0, sizeof cores, &cores) == 0 ? static_cast<unsigned>(CPU_COUNT(&cores)) : 1;
}

/// Of all cores since boot, in ticks of the system.
struct CpuTimes {
  double all = 0, stolen = 0;
};
std::optional<CpuTimes> cpu_times() {
  std::ifstream stat("/proc/stat");
  std::string cpu;
  std::array<double, 8> times{};  // user nice system idle iowait irq softirq steal
  stat >> cpu;
  for (double& time : times) stat >> time;
  if (!stat || cpu != "cpu") return std::nullopt;
  CpuTimes sums;
  for (const double time : times) sums.all += time;
  sums.stolen = times.back();
  return sums;
}

void be_ordinary() {
  const sched_param none{};
  sched_setscheduler(0, SCHED_OTHER, &none);
}

}  // namespace

Machine measure_machine(const Scene& scene, double seconds) {
  Machine m;
  m.cores = usable_cores();
  m.cpu = cpu_name();
  m.simd = to_string(resolve_simd_target(scene.engine.simd));
  for (const SimdTarget target :
       {SimdTarget::kGeneric, SimdTarget::kSse4, SimdTarget::kAvx2, SimdTarget::kAvx512})
    if (is_supported(target)) m.simd_targets.emplace_back(to_string(target));
  std::getline(std::ifstream("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"), m.governor);
  m.memory_refusal = memory_obstacle(read_realtime_limits());

  const bool is_asked = scene.realtime.fifo_priority > 0;
  m.fifo_priority = is_asked ? scene.realtime.fifo_priority : kUsualPriority;
  m.fifo_refusal = request_realtime({m.fifo_priority, false}).fifo_refusal;
  m.is_measured_with_fifo = is_asked && m.fifo_refusal.empty();
  if (!m.is_measured_with_fifo) be_ordinary();

  m.seconds = seconds;
  m.period_s = scene.period_s();
  const auto before = cpu_times();
  const std::int64_t period_ns = std::llround(1e9 * m.period_s);
  DeadlineTimer timer(period_ns, monotonic_ns() + period_ns);
  const std::int64_t end_ns = monotonic_ns() + std::llround(1e9 * seconds);
  while (timer.deadline_ns() < end_ns) m.lateness_ns.record(timer.wait());
  const auto after = cpu_times();
  if (before && after && after->all > before->all)
    m.stolen_share = (after->stolen - before->stolen) / (after->all - before->all);
  be_ordinary();
  return m;
}

}  // namespace brachy
