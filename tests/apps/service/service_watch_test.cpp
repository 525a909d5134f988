// Readiness and watchdog, in virtual time.
#include "apps/daemon/service/service_watch.h"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdlib>

#include "tests/apps/service/notify_socket.h"
#include "tests/net/manual_clock.h"

namespace brachy {
namespace {

using namespace test;
using std::chrono::seconds;

struct ServiceWatchTest : ::testing::Test {
  ServiceWatchTest() {
    ::setenv("NOTIFY_SOCKET", (folder / "notify").c_str(), 1);
    ::setenv("WATCHDOG_USEC", "20000000", 1);
    watch.emplace(loop, 0.005, ServiceWatch::Handlers{[this] { take_tick(); }, [] { return "status"; }});
  }
  ~ServiceWatchTest() override {
    ::unsetenv("NOTIFY_SOCKET");
    ::unsetenv("WATCHDOG_USEC");
  }
  void take_tick() {
    if (is_ticking) watch->on_tick(clock.now_ns());
  }
  void pass(seconds time) {
    clock.advance(time);
    loop.io().restart();
    loop.io().poll();
  }

  TempFolder folder;
  NotifySocket manager{folder / "notify"};
  net::test::ManualClock clock;
  EventLoop loop{clock};
  bool is_ticking = true;
  std::optional<ServiceWatch> watch;
};

TEST_F(ServiceWatchTest, FeedsFourTimesAPeriodWhileTheLoopTicks) {
  watch->begin();
  EXPECT_EQ(manager.count_new("READY=1"), 1);
  for (int i = 0; i < 3; ++i) {
    pass(seconds(4));
    EXPECT_EQ(manager.count_new("WATCHDOG=1"), 0);
    pass(seconds(1));
    EXPECT_EQ(manager.count_new("WATCHDOG=1"), 1);
  }
  is_ticking = false;
  for (int i = 0; i < 3; ++i) pass(seconds(5));
  EXPECT_EQ(manager.count_new("WATCHDOG=1"), 0);
  is_ticking = true;
  pass(seconds(5));
  EXPECT_EQ(manager.count_new("WATCHDOG=1"), 1);
  watch->end();
  EXPECT_EQ(manager.count_new("STOPPING=1"), 1);
  pass(seconds(5));
  EXPECT_EQ(manager.count_new("WATCHDOG=1"), 0);
}

TEST_F(ServiceWatchTest, WhereAnotherRunGoesOnTheManagerWaitsForIt) {
  watch->begin();
  EXPECT_EQ(manager.count_new("WATCHDOG_USEC=20000000"), 1);
  watch->end(ServiceWatch::End::kGoesOn);
  EXPECT_EQ(manager.count_new("WATCHDOG_USEC=60000000"), 1);
  watch.emplace(loop, 0.005, ServiceWatch::Handlers{[this] { take_tick(); }, [] { return "status"; }});
  watch->begin();
  EXPECT_EQ(manager.count_new("WATCHDOG_USEC=20000000"), 1);
}

TEST_F(ServiceWatchTest, ALoopThatIsSilentForMoreThanASecondHasFailed) {
  pass(seconds(10));
  watch->begin();  // what was before does not count
  is_ticking = false;
  EXPECT_EQ(watch->failure(), "");
  pass(seconds(1));
  EXPECT_EQ(watch->failure(), "");
  pass(seconds(1));
  EXPECT_EQ(watch->failure(), "the deformation loop has not ticked for 2.0 s");
  is_ticking = true;
  EXPECT_EQ(watch->failure(), "");
}

TEST_F(ServiceWatchTest, TellsWhenAReloadBegan) {
  watch->reloading();
  EXPECT_EQ(manager.count_new("RELOADING=1"), 1);
  EXPECT_NE(manager.messages.back().find("MONOTONIC_USEC=" + std::to_string(clock.now_ns() / 1000) + "\n"),
            std::string::npos);
  watch->reloaded("read again");
  EXPECT_EQ(manager.count_new("STATUS=read again"), 1);
}

}  // namespace
}  // namespace brachy
