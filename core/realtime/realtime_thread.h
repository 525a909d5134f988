#pragma once

#include <cstdint>
#include <string>

namespace brachy {

/// Requests to the kernel; both off by default.
struct RealtimeOptions {
  int fifo_priority = 0;  ///< SCHED_FIFO priority 1–99 of the calling thread; 0 = leave the scheduling alone
  bool lock_memory = false;  ///< keep the whole process in RAM (mlockall), present and future mappings
};

/// What a thread may request: its process's soft limits and its own effective capabilities.
struct RealtimeLimits {
  static constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};
  std::uint64_t rtprio = 0;         ///< RLIMIT_RTPRIO
  std::uint64_t memlock_bytes = 0;  ///< RLIMIT_MEMLOCK
  bool cap_sys_nice = false;
  bool cap_ipc_lock = false;
};

enum class Grant : std::uint8_t { kNotAsked, kGranted, kRefused };

/// What was granted; for refusals the reason and the fix.
struct RealtimeGrant {
  Grant fifo = Grant::kNotAsked;
  int fifo_priority = 0;     ///< in force; 0 unless granted
  std::string fifo_refusal;  ///< empty unless refused
  Grant memory = Grant::kNotAsked;
  bool memory_is_locked_later = false;  ///< also future mappings; false: those would need a capability
  std::string memory_refusal;           ///< empty unless refused
};

/// The limits of this process and the capabilities of the calling thread, from getrlimit and
/// /proc/thread-self/status (no capability if that is unreadable).
RealtimeLimits read_realtime_limits();

/// Why SCHED_FIFO at this priority would be refused, with the fix; empty if the limits allow it.
std::string fifo_obstacle(const RealtimeLimits& limits, int priority);

/// Why the memory must not be locked, with the fix; empty if the limits allow it. A finite RLIMIT_MEMLOCK
/// without CAP_IPC_LOCK is such a reason even where mlockall would succeed: under MCL_FUTURE every later
/// mapping counts, and the first thread created beyond the limit would fail.
std::string memory_obstacle(const RealtimeLimits& limits);

/// Requests what the options specify: SCHED_FIFO for the calling thread (SCHED_RESET_ON_FORK: threads it
/// creates, such as OpenMP's workers, get normal scheduling), the memory lock for the process, which remains
/// in force after capabilities are dropped (RLIMIT_MEMLOCK is raised for that if permitted); touches the
/// calling thread's stack if either was requested. Never throws and never ends the program: a refusal is in
/// the result.
///
/// Threads: called by the thread that is to be real-time, at its start. Creates none.
///
/// Real-time: no; before the first tick.
RealtimeGrant request_realtime(const RealtimeOptions& options);

/// One line for the log.
std::string to_string(const RealtimeGrant& grant);

}  // namespace brachy
