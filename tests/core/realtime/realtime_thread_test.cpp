#include "core/realtime/realtime_thread.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "core/realtime/capabilities.h"

namespace brachy {
namespace {

RealtimeLimits unprivileged() {
  return {0, 8192 * 1024, false, false};
}

TEST(RealtimeThread, NothingAskedChangesNothing) {
  const int before = sched_getscheduler(0);
  const RealtimeGrant grant = request_realtime({});
  EXPECT_EQ(grant.fifo, Grant::kNotAsked);
  EXPECT_EQ(grant.memory, Grant::kNotAsked);
  EXPECT_EQ(sched_getscheduler(0), before);
  EXPECT_EQ(to_string(grant), "real time: SCHED_FIFO not requested, memory lock not requested");
}

TEST(RealtimeThread, FifoNeedsTheLimitOrTheCapability) {
  RealtimeLimits limits = unprivileged();
  EXPECT_NE(fifo_obstacle(limits, 50).find("RLIMIT_RTPRIO is 0"), std::string::npos);
  limits.rtprio = 49;
  EXPECT_FALSE(fifo_obstacle(limits, 50).empty());
  EXPECT_TRUE(fifo_obstacle(limits, 49).empty());
  limits.rtprio = RealtimeLimits::kUnlimited;
  EXPECT_TRUE(fifo_obstacle(limits, 99).empty());
  limits = unprivileged();
  limits.cap_sys_nice = true;
  EXPECT_TRUE(fifo_obstacle(limits, 99).empty());
}

TEST(RealtimeThread, FifoPriorityOutOfRangeIsRefused) {
  RealtimeLimits limits = unprivileged();
  limits.cap_sys_nice = true;
  for (int priority : {-1, 0, 100}) {
    EXPECT_NE(fifo_obstacle(limits, priority).find("1 to 99"), std::string::npos) << priority;
  }
  EXPECT_EQ(request_realtime({100, false}).fifo, Grant::kRefused);
}

TEST(RealtimeThread, MemoryIsNotLockedUnderAFiniteLimitWithoutTheCapability) {
  RealtimeLimits limits = unprivileged();
  EXPECT_NE(memory_obstacle(limits).find("RLIMIT_MEMLOCK is 8192 KiB"), std::string::npos);
  limits.memlock_bytes = RealtimeLimits::kUnlimited;
  EXPECT_TRUE(memory_obstacle(limits).empty());
  limits = unprivileged();
  limits.cap_ipc_lock = true;
  EXPECT_TRUE(memory_obstacle(limits).empty());
}

TEST(RealtimeThread, TheReportIsOneLineWithReasons) {
  RealtimeGrant grant;
  grant.fifo = Grant::kGranted;
  grant.fifo_priority = 80;
  grant.memory = Grant::kRefused;
  grant.memory_refusal = "why not; what to do";
  EXPECT_EQ(to_string(grant),
            "real time: SCHED_FIFO priority 80 granted, memory lock refused (why not; what to do)");
}

/// In a child, so that this process stays an ordinary one: requests everything, and checks that the report is correct
/// and that threads can still be created. Exit code 0 if so.
int ask_for_everything() {
  const RealtimeGrant grant = request_realtime({10, true});
  const bool is_fifo = (sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) == SCHED_FIFO;
  if (is_fifo != (grant.fifo == Grant::kGranted)) return 1;
  if (grant.fifo == Grant::kRefused && grant.fifo_refusal.empty()) return 2;
  if (grant.memory == Grant::kRefused && grant.memory_refusal.empty()) return 3;
  try {
    int policy = -1;
    std::thread([&policy] { policy = sched_getscheduler(0); }).join();
    if (policy != SCHED_OTHER) return 4;  // OpenMP's workers must not inherit SCHED_FIFO
  } catch (const std::system_error&) {
    return 5;
  }
  return 0;
}

/// Uses `depth` KiB of the stack.
[[gnu::noinline]] int use_stack(int depth) {
  volatile char kilobyte[1024] = {};
  kilobyte[0] = 1;
  return depth == 0 ? 0 : kilobyte[0] + use_stack(depth - 1);
}

/// In a child: what was granted remains, and threads, memory and stack can still be allocated, after capabilities are
/// dropped. Exit code 0 if so, kNothingToDrop where there were none.
constexpr int kNothingToDrop = 77;
int give_up_capabilities() {
  const auto is_without = [] {
    std::ifstream status("/proc/thread-self/status");
    int as_wanted = 0;
    for (std::string key, value; status >> key >> value; status.ignore(4096, '\n')) {
      if (key == "CapInh:" || key == "CapPrm:" || key == "CapEff:" || key == "CapAmb:")
        as_wanted += value.find_first_not_of('0') == std::string::npos;
      if (key == "NoNewPrivs:") as_wanted += value == "1";
    }
    return as_wanted == 5;
  };
  const bool had_some = read_realtime_limits().cap_ipc_lock || read_realtime_limits().cap_sys_nice;
  const RealtimeGrant grant = request_realtime({10, true});
  drop_capabilities();
  if (!is_without()) return 1;
  bool is_thread_without = false;
  std::thread([&] { is_thread_without = is_without(); }).join();
  if (!is_thread_without) return 2;
  const bool is_fifo = (sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) == SCHED_FIFO;
  if (is_fifo != (grant.fifo == Grant::kGranted)) return 3;
  const std::vector<char> memory(64 << 20, 1);
  if (use_stack(2048) != 2048 || memory.back() != 1) return 4;
  if (request_realtime({11, false}).fifo == Grant::kGranted && read_realtime_limits().rtprio == 0) return 5;
  return had_some ? 0 : kNothingToDrop;
}

TEST(RealtimeThread, WithoutCapabilitiesWhatWasGrantedStaysAndMemoryCanBeHad) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) std::_Exit(give_up_capabilities());
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
  if (WEXITSTATUS(status) == kNothingToDrop) GTEST_SKIP() << "there is no capability to give up";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(RealtimeThread, WhateverIsGrantedTheReportIsTrueAndThreadsCanBeCreated) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) std::_Exit(ask_for_everything());
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace brachy
