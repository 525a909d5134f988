// When the io thread sends forces, in virtual time.
#include "apps/daemon/forces/force_cycle.h"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <vector>

#include "tests/haptics/milliseconds.h"
#include "tests/net/manual_clock.h"

namespace brachy {
namespace {

struct ForceCycleTest : ::testing::Test {
  void run(int milliseconds) {
    for (int i = 0; i < milliseconds; ++i) pass(kMs);
  }
  void pass(std::int64_t ns) {
    clock.advance(std::chrono::nanoseconds(ns));
    loop.io().restart();
    loop.io().poll();
  }
  void publish() {
    ++ticks.writer.slot().tick;
    ticks.writer.publish();
  }
  static net::DeviceInfo device(double rate_hz) {
    net::DeviceInfo device;
    device.takes_force = true;
    device.limits.rate_hz = rate_hz;
    return device;
  }
  ForceLinkOutputs outputs() {
    ForceLinkOutputs o;
    o.send_force = [this](const net::ForceMessage&) { sent_ns.push_back(clock.now_ns() - begin_ns); };
    o.send_model = [](const net::LocalModelMessage&) {};
    o.round_trip_s = [](std::uint16_t) { return 0.0002; };
    o.announce = [](const net::EventMessage&) {};
    return o;
  }
  std::vector<std::int64_t> every(std::int64_t period_ns, std::int64_t until_ns) const {
    std::vector<std::int64_t> times;
    for (std::int64_t at = 0; at <= until_ns; at += period_ns) times.push_back(at);
    return times;
  }

  net::test::ManualClock clock;
  const std::int64_t begin_ns = clock.now_ns();
  EventLoop loop{clock};
  HandOver<TickForces> ticks{TickForces(1)};
  std::vector<std::int64_t> sent_ns;
  int ticks_seen = 0;
  ForceCycle cycle{loop, ticks.reader, 1, outputs(), [this](const TickForces&) { ++ticks_seen; }};
};

TEST_F(ForceCycleTest, SendsAtTheRateOfTheDeviceAndAtAThousandASecondAtMost) {
  cycle.on_device(true, device(100));
  run(100);
  EXPECT_EQ(sent_ns, every(10 * kMs, 100 * kMs));
  cycle.on_device(false, device(100));
  run(100);
  sent_ns.clear();
  const std::int64_t at_ns = clock.now_ns() - begin_ns;
  cycle.on_device(true, device(4000));
  run(50);
  ASSERT_EQ(sent_ns.size(), 51u);
  EXPECT_EQ(sent_ns.front(), at_ns);
  EXPECT_EQ(sent_ns.back(), at_ns + 50 * kMs);
}

TEST_F(ForceCycleTest, MissedCyclesAreSkipped) {
  cycle.on_device(true, device(1000));
  run(5);
  sent_ns.clear();
  pass(50 * kMs);  // the thread was busy
  run(2);
  EXPECT_EQ(sent_ns, (std::vector<std::int64_t>{55 * kMs, 56 * kMs, 57 * kMs}));
}

TEST_F(ForceCycleTest, TakesTicksWhileADeviceIsThereAndSendsNothingOnceStopped) {
  publish();
  run(5);
  EXPECT_EQ(ticks_seen, 0) << "nobody is there to feel it";
  cycle.update();
  EXPECT_EQ(ticks_seen, 1);
  cycle.on_device(true, device(1000));
  publish();
  run(5);
  EXPECT_EQ(ticks_seen, 2);
  cycle.stop();
  sent_ns.clear();
  run(100);
  cycle.on_device(true, device(1000));
  run(100);
  EXPECT_TRUE(sent_ns.empty());
}

}  // namespace
}  // namespace brachy
