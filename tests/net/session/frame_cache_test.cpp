#include "net/session/frame_cache.h"

#include "tests/net/net_testing.h"

namespace brachy::net::test {
namespace {

TEST(FrameCache, EncodesEachDistinctRequestOnceASnapshot) {
  const Tissue tissue = line_tissue(20);
  FakeSimulation simulation(tissue);
  const FrameLayout layout = make_layout(tissue, make_topology(tissue, "line"));
  FrameCache cache(layout, layout);
  EXPECT_FALSE(cache.has_snapshot());
  for (std::uint64_t snapshot = 1; snapshot <= 5; ++snapshot) {
    simulation.steps(6);
    cache.update(simulation.snapshot());
    const std::uint64_t last = 6 * (snapshot - 1);
    const auto body = cache.body({last, false, false});
    for (int client = 0; client < 20; ++client) EXPECT_EQ(cache.body({last, false, false}), body);
    EXPECT_EQ(cache.encoded(), snapshot);
    EXPECT_EQ(cache.snapshots(), snapshot);
    EXPECT_EQ(cache.tick(), 6 * snapshot);
  }
  const auto full = cache.body({3, true, false});
  EXPECT_EQ(cache.body({7, true, false}), full);  // what a full frame is relative to does not matter
  EXPECT_NE(cache.body({7, true, true}), full);   // but to the pose history it does
  EXPECT_NE(cache.body({7, true, true}), cache.body({8, true, true}));
}

}  // namespace
}  // namespace brachy::net::test
