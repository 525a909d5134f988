// The pages about exercises: how long a result is good for, in virtual time.
#include "apps/daemon/exercise/exercise_pages.h"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/apps/apps_testing.h"
#include "tests/net/manual_clock.h"

namespace brachy {
namespace {

using namespace test;

TEST(ExercisePages, AResultIsGoodForTwoSecondsAndThenMadeAgain) {
  net::test::ManualClock clock;
  EventLoop loop(clock);
  std::atomic<int> scored{0};
  ExercisePages exercises(
      loop, kConfigFolder / "exercises/scenes/01_one_needle.toml",
      [&] {
        ++scored;
        return Score();
      },
      [] {});
  ASSERT_NE(exercises.running(), nullptr);
  auto pages = exercises.pages();
  const auto state = [&] {
    return nlohmann::json::parse(pages.at("/exercise-result").make().text).at("state").get<std::string>();
  };
  const auto is_scored = [&] {
    return wait_until([&] { return !exercises.is_scoring(); },
                      [&] {
                        loop.io().restart();
                        loop.io().poll();
                        std::this_thread::yield();
                      });
  };
  EXPECT_EQ(state(), "scoring");
  ASSERT_TRUE(is_scored());
  EXPECT_EQ(state(), "scored");
  clock.advance(std::chrono::milliseconds(1999));
  EXPECT_EQ(state(), "scored");
  EXPECT_EQ(scored, 1);
  clock.advance(std::chrono::milliseconds(1));
  EXPECT_EQ(state(), "scoring");
  EXPECT_EQ(state(), "scoring") << "once at a time";
  ASSERT_TRUE(is_scored());
  EXPECT_EQ(state(), "scored");
  EXPECT_EQ(scored, 2);
}

}  // namespace
}  // namespace brachy
