#include "apps/daemon/network_log.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/net/manual_clock.h"

namespace brachy {
namespace {

struct NetworkLogTest : ::testing::Test {
  static constexpr auto kBurst = static_cast<std::size_t>(NetworkLog::kBurst);

  net::test::ManualClock clock;
  std::vector<std::string> lines;
  std::vector<NetworkLog::Level> levels;
  NetworkLog log{clock, [this](NetworkLog::Level level, const std::string& line) {
                   levels.push_back(level);
                   lines.push_back(line);
                 }};
};

TEST_F(NetworkLogTest, AFloodPassesAsABurstAndThenSlowlyWithTheRestCounted) {
  for (std::size_t i = 0; i < kBurst + 1000; ++i) log.info("line");
  ASSERT_EQ(lines.size(), kBurst);
  clock.advance(std::chrono::seconds(1));
  log.warn("later");
  ASSERT_EQ(lines.size(), kBurst + 2);
  EXPECT_EQ(lines[kBurst], "1000 lines about the network left out: too many at once");
  EXPECT_EQ(levels[kBurst], NetworkLog::Level::kWarning);
  EXPECT_EQ(lines[kBurst + 1], "later");
  for (int s = 3; s < 13; ++s) {
    clock.advance(std::chrono::seconds(1));
    for (int i = 0; i < 100; ++i) log.info("line");
  }
  EXPECT_LE(lines.size(), kBurst + 2 + 60 + 20);
}

TEST_F(NetworkLogTest, WhatWasLeftOutLastIsSaidAtTheEnd) {
  for (std::size_t i = 0; i < kBurst + 3; ++i) log.info("line");
  log.end();
  log.end();
  ASSERT_EQ(lines.size(), kBurst + 1);
  EXPECT_TRUE(lines.back().starts_with("3 lines")) << lines.back();
}

TEST_F(NetworkLogTest, ControlCharactersStandInNoLine) {
  log.info(
      "a\x1b[31mb\nc\x7f\xc2\x9b"
      "d\xff é");
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0], "a?[31mb?c???d? é");
}

}  // namespace
}  // namespace brachy
