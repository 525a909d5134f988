#include "apps/daemon/forces/safety_notices.h"

#include <gtest/gtest.h>

#include <vector>

#include "apps/daemon/network_log.h"
#include "tests/net/manual_clock.h"

namespace brachy {
namespace {

struct SafetyNoticesTest : ::testing::Test {
  static net::EventMessage event(std::uint16_t needle, const std::string& text) {
    return {net::EventKind::kSafety, needle, 0, text};
  }
  /// How often the events passed on say that `text` happened.
  std::uint64_t told(const std::string& text) const {
    std::uint64_t count = 0;
    for (const auto& e : passed) {
      if (!e.text.starts_with(text)) continue;
      const bool is_several = e.text.ends_with(" times)");
      count += is_several ? std::stoull(e.text.substr(e.text.rfind(" (") + 2)) : 1;
    }
    return count;
  }

  net::test::ManualClock clock;
  std::vector<net::EventMessage> passed;
  SafetyNotices notices{clock, [this](const net::EventMessage& e) { passed.push_back(e); }};
};

TEST_F(SafetyNoticesTest, AFloodOfOneNeedleCrowdsOutNoneOfAnother) {
  for (int i = 0; i < 10'000; ++i) {
    notices.add(event(1, "pose has NaN"));
    notices.add(event(1, "armed by mallory (127.0.0.3:" + std::to_string(i) + "): back"));
  }
  notices.add(event(0, "no pose for 50 ms"));
  EXPECT_EQ(passed.size(), static_cast<std::size_t>(SafetyNotices::kBurst));
  clock.advance(std::chrono::seconds(1));
  notices.update();
  EXPECT_EQ(told("no pose for 50 ms"), 1u);
  EXPECT_EQ(told("pose has NaN"), 10'000u);
  EXPECT_EQ(told("armed by mallory"), 10'000u);
  EXPECT_LE(passed.size(), 43u);
}

TEST_F(SafetyNoticesTest, TheEndPassesOnWhatWaits) {
  for (int i = 0; i < 1000; ++i) notices.add(event(static_cast<std::uint16_t>(i), "device lost in contact"));
  notices.end();
  EXPECT_EQ(told("device lost in contact"), 1000u);
}

TEST_F(SafetyNoticesTest, AFloodOfOtherLinesLeavesTheirsInTheLog) {
  std::vector<std::string> lines;
  NetworkLog log(clock, [&](NetworkLog::Level, const std::string& line) { lines.push_back(line); });
  SafetyNotices safety(clock, [&](const net::EventMessage& e) { log.safety("safety: " + e.text); });
  for (int i = 0; i < 10'000; ++i) log.info("client " + std::to_string(i) + " joined");
  safety.add(event(0, "device lost in contact"));
  EXPECT_EQ(lines.back(), "safety: device lost in contact");
}

}  // namespace
}  // namespace brachy
