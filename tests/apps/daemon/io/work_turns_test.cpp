#include "apps/daemon/io/work_turns.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

namespace brachy {
namespace {

/// Peers' work, and what happened on the io thread, in its order.
struct WorkTurnsTest : ::testing::Test {
  bool add(std::uint64_t peer, const std::string& name) {
    return turns.add(peer, [this, name] {
      happened.push_back(name + " prepared");
      return WorkTurns::Work([this, name] {
        EXPECT_NE(std::this_thread::get_id(), io_thread);
        return WorkTurns::Finish([this, name] { finish(name); });
      });
    });
  }
  void finish(const std::string& name) {
    EXPECT_EQ(std::this_thread::get_id(), io_thread);
    happened.push_back(name);
    if (on_finish) on_finish(name);
  }
  /// Runs the loop until all is done.
  void run() {
    open->start(std::chrono::minutes(10), [] {});
    loop.post([this] { end_if_done(); });
    loop.run();
  }
  void end_if_done() {
    if (turns.is_empty()) return open->cancel();
    loop.post([this] { end_if_done(); });
  }

  const std::thread::id io_thread = std::this_thread::get_id();
  std::vector<std::string> happened;
  std::function<void(const std::string&)> on_finish;
  EventLoop loop{net::real_clock()};
  std::unique_ptr<net::Timer> open = loop.make_timer();
  Worker worker;
  WorkTurns turns{loop, worker};
};

TEST_F(WorkTurnsTest, OneAfterTheOtherEachPreparedAtItsTurn) {
  EXPECT_TRUE(turns.is_empty());
  EXPECT_TRUE(add(1, "a"));
  EXPECT_TRUE(add(2, "b"));
  EXPECT_FALSE(turns.is_empty());
  run();
  EXPECT_EQ(happened, (std::vector<std::string>{"a prepared", "a", "b prepared", "b"}));
}

TEST_F(WorkTurnsTest, WhoAsksAgainAndAgainComesAfterTheOthers) {
  int rounds = 0;
  on_finish = [&](const std::string& name) {
    if (name != "greedy") return;
    EXPECT_FALSE(add(1, "greedy")) << "its last work is just being finished";
    if (++rounds < 3) loop.post([&] { EXPECT_TRUE(add(1, "greedy")); });
  };
  EXPECT_TRUE(add(1, "greedy"));
  EXPECT_FALSE(add(1, "greedy"));
  EXPECT_TRUE(add(2, "patient"));
  EXPECT_TRUE(add(3, "other"));
  EXPECT_FALSE(add(2, "patient"));
  run();
  std::erase_if(happened, [](const std::string& name) { return name.ends_with("prepared"); });
  ASSERT_GE(happened.size(), 3u);
  happened.resize(3);
  EXPECT_EQ(happened, (std::vector<std::string>{"greedy", "patient", "other"}));
}

TEST_F(WorkTurnsTest, WhatHasNothingToDoTakesNoTurn) {
  EXPECT_TRUE(turns.add(1, [] { return WorkTurns::Work(); }));
  EXPECT_TRUE(turns.is_empty());
  EXPECT_TRUE(add(1, "a"));
  EXPECT_TRUE(turns.add(2, [] { return WorkTurns::Work(); }));
  run();
  EXPECT_EQ(happened, (std::vector<std::string>{"a prepared", "a"}));
}

}  // namespace
}  // namespace brachy
