#include "haptics/simulated/delay_line.h"

#include <gtest/gtest.h>

#include <vector>

namespace brachy {
namespace {

TEST(DelayLine, GivesTheNewestThatHasArrived) {
  DelayLine<int> line(10);
  line.push(1, 0);
  line.push(2, 3);
  line.push(3, 8);
  EXPECT_FALSE(line.newest(9));
  EXPECT_EQ(line.newest(13), 2);
  EXPECT_FALSE(line.newest(17)) << "given out once";
  EXPECT_EQ(line.newest(18), 3);
}

TEST(DelayLine, LosesTheSameForTheSameSeed) {
  const auto arrived = [](std::uint64_t seed) {
    DelayLine<int> line(0, 0.25, seed);
    std::vector<int> values;
    for (int i = 0; i < 4000; ++i) {
      line.push(i, i);
      if (const auto value = line.newest(i)) values.push_back(*value);
    }
    EXPECT_EQ(line.lost(), 4000 - values.size());
    return values;
  };
  EXPECT_EQ(arrived(1), arrived(1));
  EXPECT_NE(arrived(1), arrived(2));
  EXPECT_NEAR(static_cast<double>(arrived(1).size()), 3000, 100);
}

}  // namespace
}  // namespace brachy
