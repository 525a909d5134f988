// The pages about exercises: how long a result is good for, in virtual time.
#include "apps/daemon/exercise/exercise_pages.h"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/base/error.h"
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
      loop, kConfigFolder / "exercises/scenes/01_one_needle.toml", std::nullopt,
      [&] {
        ++scored;
        return ScoredSession{Score(), "<p>report " + std::to_string(scored) + "</p>"};
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
  EXPECT_EQ(pages.at("/exercise-report").make().status, 404);
  EXPECT_EQ(state(), "scoring");
  ASSERT_TRUE(is_scored());
  EXPECT_EQ(state(), "scored");
  EXPECT_EQ(pages.at("/exercise-report").make().text, "<p>report 1</p>");
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

TEST(ExercisePages, AttemptsNeedADirectoryAndCountWhatPassed) {
  net::test::ManualClock clock;
  EventLoop loop(clock);
  const TempFolder folder;
  for (const char* session : {"0001_x", "0002_x", "0003_x"}) {
    std::filesystem::create_directories(folder / session);
    folder.write(std::string(session) + "/report.json",
                 std::string(R"({"exercise":{"name":"one needle to a point","passed":)") +
                     (session[3] == '2' ? "false" : "true") + ",\"lines\":[]}}");
  }
  ExercisePages exercises(loop, kConfigFolder / "exercises/scenes/01_one_needle.toml", folder / "", nullptr,
                          [] {});
  auto pages = exercises.pages();
  const auto list = [&] { return nlohmann::json::parse(pages.at("/exercises").make().text); };
  EXPECT_EQ(list().at("attempts"), true);
  EXPECT_EQ(list().at("recorded"), false);
  EXPECT_TRUE(wait_until([&] { return list().at("exercises").at(0).at("passed") == 2; },
                         [&] {
                           loop.io().restart();
                           loop.io().poll();
                           std::this_thread::yield();
                         }));
  const Attempt attempt = exercises.attempt("02_one_train.toml", "Anna");
  EXPECT_EQ(attempt.session.filename(), "0004_02_one_train");
  EXPECT_EQ(attempt.scene.filename(), "02_one_train.toml");
  EXPECT_FALSE(std::filesystem::exists(attempt.session));
  EXPECT_THROW(exercises.attempt("../exercises/02_one_train.toml", ""), UserError);
}

}  // namespace
}  // namespace brachy
