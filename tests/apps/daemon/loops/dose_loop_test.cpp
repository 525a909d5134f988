#include "apps/daemon/loops/dose_loop.h"

#include <gtest/gtest.h>

#include <algorithm>

#include <functional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "core/brachytherapy/plan/plan.h"
#include "core/geometry/tissue/phantom.h"

namespace brachy {
namespace {

/// Goes on only while it is waited for, and tells when it is looked at.
struct WatchedClock final : Clock {
  std::int64_t now_ns() override {
    if (on_look) on_look();
    return now;
  }
  void sleep_until_ns(std::int64_t then_ns) override { now = std::max(now, then_ns); }
  std::function<void()> on_look;
  std::int64_t now = 1'000'000'000;
};

/// Needles through all holes of the template, with 15 seeds each.
Plan largest_plan(const TemplateGrid& grid) {
  Plan plan;
  plan.base_plane_mm = 100;
  plan.air_kerma_strength_u = 0.5;
  for (int column = 0; column < grid.columns; ++column)
    for (int row = 0; row < grid.rows; ++row)
      plan.needles.push_back({grid.name(column, row), 0, std::string(15, 's')});
  return plan;
}

/// One seed, which fell just now.
DroppedSeeds one_seed() {
  MeshState state;
  state.seeds.slots.resize(8);
  DroppedSeeds seeds(state);
  seeds.slots[0].air_kerma_strength_u = 0.5;
  seeds.count = 1;
  seeds.publish_ns = 1;
  return seeds;
}

struct DoseLoop : ::testing::Test {
  DoseLoop() {
    fallen.writer.slot() = one_seed();
    fallen.writer.publish();
  }
  void run() {
    run_dose_loop(stop.get_token(), clock, {{"prostate", prostate_phantom(400)}}, DoseSettings(), {},
                  {plan.reader, {}}, fallen.reader, [&](net::DoseMessage message) {
                    delivered.push_back(std::move(message));
                    stop.request_stop();
                  });
  }

  const TemplateGrid grid;
  WatchedClock clock;
  std::stop_source stop;
  HandOver<DroppedSeeds> fallen{DroppedSeeds(MeshState())};
  HandOver<LoadingPlan> plan{LoadingPlan(largest_plan(grid), grid)};
  std::vector<net::DoseMessage> delivered;
};

// 2,535 seeds kept the daemon's end waiting for 3.6 s.
TEST_F(DoseLoop, ItsEndDoesNotWaitForTheSeedsOfALargePlan) {
  int looks = 0;
  clock.on_look = [&] {
    if (++looks == 2)
      stop.request_stop();  // the dose of what has fallen is there; the plan's would come next
  };
  run();
  EXPECT_EQ(looks, 2);
  EXPECT_TRUE(delivered.empty());
}

TEST_F(DoseLoop, WhatHasFallenAndWhatIsPlannedAreDelivered) {
  Plan small = largest_plan(grid);
  small.needles.resize(3);
  plan.writer.slot() = LoadingPlan(small, grid);
  plan.writer.publish();
  run();
  ASSERT_EQ(delivered.size(), 1u);
  EXPECT_EQ(delivered[0].seeds, 1u);
  EXPECT_EQ(delivered[0].with_planned.size(), 1u);
}

}  // namespace
}  // namespace brachy
