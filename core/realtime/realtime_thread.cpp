#include "core/realtime/realtime_thread.h"

#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace brachy {

namespace {

// Bit numbers of <linux/capability.h>.
constexpr int kCapIpcLock = 14;
constexpr int kCapSysNice = 23;

constexpr std::size_t kPrefaultBytes = 256 * 1024;  // of the default 8 MiB; a tick's frames are far smaller

std::uint64_t soft_limit(__rlimit_resource resource) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0) return 0;
  return limit.rlim_cur == RLIM_INFINITY ? RealtimeLimits::kUnlimited : limit.rlim_cur;
}

std::uint64_t effective_capabilities() {
  std::ifstream status("/proc/thread-self/status");  // each thread has its own
  for (std::string key; status >> key; status.ignore(4096, '\n')) {
    if (key != "CapEff:") continue;
    std::uint64_t bits = 0;
    return status >> std::hex >> bits ? bits : 0;
  }
  return 0;
}

/// Pre-faults the stack below this frame, so that no tick takes a page fault there.
[[gnu::noinline]] void prefault_stack() {
  volatile unsigned char stack[kPrefaultBytes];
  for (std::size_t i = 0; i < kPrefaultBytes; i += 1024) stack[i] = 0;
  static_cast<void>(stack[0]);
}

std::string set_fifo(const RealtimeLimits& limits, int priority) {
  if (std::string obstacle = fifo_obstacle(limits, priority); !obstacle.empty()) return obstacle;
  sched_param parameters{};
  parameters.sched_priority = priority;
  if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) == 0) return {};
  return std::string("the limits allow it but the kernel says ") + std::strerror(errno) +
         "; in a container, grant it CAP_SYS_NICE and a real-time share (cpu.rt_runtime_us)";
}

/// Unlocks the first thread's stack: it grows as it is used, which locked pages under a finite limit prevent.
void unlock_first_stack() {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    if (!line.ends_with("[stack]")) continue;
    char* end = nullptr;
    const std::uintptr_t first = std::strtoull(line.c_str(), &end, 16);
    const std::uintptr_t last = std::strtoull(end + 1, nullptr, 16);
    munlock(reinterpret_cast<void*>(first), last - first);
  }
}

/// Locks present pages, and future ones only if no limit will apply after the capability that permits it has been
/// dropped (core/realtime/capabilities.h): allocations would fail otherwise. False: see errno.
bool lock_all(const RealtimeLimits& limits, bool& is_later_locked) {
  const rlimit unlimited{RLIM_INFINITY, RLIM_INFINITY};
  is_later_locked =
      limits.memlock_bytes == RealtimeLimits::kUnlimited || setrlimit(RLIMIT_MEMLOCK, &unlimited) == 0;
  if (mlockall(is_later_locked ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT) != 0) return false;
  if (!is_later_locked) unlock_first_stack();
  return true;
}

std::string lock_memory(const RealtimeLimits& limits, bool& is_later_locked) {
  if (std::string obstacle = memory_obstacle(limits); !obstacle.empty()) return obstacle;
  if (lock_all(limits, is_later_locked)) return {};
  const std::string why = std::strerror(errno);
  // CAP_IPC_LOCK of a user namespace shows in /proc but does not lift the limit.
  if (std::string obstacle =
          memory_obstacle({limits.rtprio, limits.memlock_bytes, limits.cap_sys_nice, false});
      !obstacle.empty())
    return obstacle;
  return "the limits allow it but the kernel says " + why + "; check the memory limit of the container";
}

std::string describe(Grant grant, const std::string& refusal) {
  switch (grant) {
    case Grant::kNotAsked:
      return "not requested";
    case Grant::kGranted:
      return "granted";
    case Grant::kRefused:
      break;
  }
  return "refused (" + refusal + ")";
}

}  // namespace

RealtimeLimits read_realtime_limits() {
  const std::uint64_t capabilities = effective_capabilities();
  RealtimeLimits limits;
  limits.rtprio = soft_limit(RLIMIT_RTPRIO);
  limits.memlock_bytes = soft_limit(RLIMIT_MEMLOCK);
  limits.cap_sys_nice = (capabilities >> kCapSysNice & 1) != 0;
  limits.cap_ipc_lock = (capabilities >> kCapIpcLock & 1) != 0;
  return limits;
}

std::string fifo_obstacle(const RealtimeLimits& limits, int priority) {
  if (priority < 1 || priority > 99) {
    return "priority " + std::to_string(priority) + " is not within 1 to 99";
  }
  if (limits.cap_sys_nice || limits.rtprio >= static_cast<std::uint64_t>(priority)) return {};
  return "RLIMIT_RTPRIO is " + std::to_string(limits.rtprio) + ", below " + std::to_string(priority) +
         ", and CAP_SYS_NICE is missing; set LimitRTPRIO=99 in the unit or rtprio in limits.conf";
}

std::string memory_obstacle(const RealtimeLimits& limits) {
  if (limits.cap_ipc_lock || limits.memlock_bytes == RealtimeLimits::kUnlimited) return {};
  return "RLIMIT_MEMLOCK is " + std::to_string(limits.memlock_bytes / 1024) +
         " KiB, and once it is used up no thread can be created; set LimitMEMLOCK=infinity in the unit, "
         "ulimit -l unlimited, or grant CAP_IPC_LOCK";
}

RealtimeGrant request_realtime(const RealtimeOptions& options) {
  const RealtimeLimits limits = read_realtime_limits();
  RealtimeGrant grant;
  if (options.lock_memory) {
    grant.memory_refusal = lock_memory(limits, grant.memory_is_locked_later);
    grant.memory = grant.memory_refusal.empty() ? Grant::kGranted : Grant::kRefused;
  }
  if (options.fifo_priority != 0) {
    grant.fifo_refusal = set_fifo(limits, options.fifo_priority);
    grant.fifo = grant.fifo_refusal.empty() ? Grant::kGranted : Grant::kRefused;
    if (grant.fifo == Grant::kGranted) grant.fifo_priority = options.fifo_priority;
  }
  if (options.lock_memory || options.fifo_priority != 0) prefault_stack();
  return grant;
}

std::string to_string(const RealtimeGrant& grant) {
  std::string line = "real time: SCHED_FIFO ";
  if (grant.fifo == Grant::kGranted) line += "priority " + std::to_string(grant.fifo_priority) + " ";
  line += describe(grant.fifo, grant.fifo_refusal);
  line += ", memory lock " + describe(grant.memory, grant.memory_refusal);
  if (grant.memory == Grant::kGranted && !grant.memory_is_locked_later) line += " for present mappings only";
  return line;
}

}  // namespace brachy
