// Attempts at exercises, one after the other in one brachyd.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/session/session_manifest.h"
#include "core/base/error.h"
#include "net/access/token_file.h"
#include "tests/apps/http_get.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"
#include "tests/wait.h"

namespace brachy {
namespace {

using namespace test;
namespace fs = std::filesystem;

const std::string kOneNeedle = std::string(BRACHY_SOURCE_DIR) + "/config/exercises/scenes/01_one_needle.toml";

struct BrachydExercise : ::testing::Test {
  TempFolder folder;
  std::string sessions = (folder / "class").string();

  /// Asks for an attempt, and waits until the daemon has let go.
  static void begin(RunningBrachyd& brachyd, const std::string& file, const std::string& trainee) {
    Peer boss(net::Role::kOperator);
    ASSERT_TRUE(boss.join(brachyd.port));
    boss.client.send(net::ExerciseMessage{file, trainee});
    ASSERT_TRUE(boss.until([&] { return !boss.closed.empty() || !boss.errors.empty(); }));
    ASSERT_FALSE(boss.errors.empty());
    EXPECT_EQ(boss.errors.front().code, net::ErrorCode::kShutdown);
    EXPECT_EQ(boss.errors.front().text, "exercise " + file + " begins" +
                                            (trainee.empty() ? "" : " for " + trainee) + ": connect again");
  }
  /// Whether somebody can join, also where the next run does not listen yet.
  static bool comes_back(RunningBrachyd& brachyd, const net::ClientOptions& as = {}) {
    const auto joins = [&] {
      try {
        return Peer(as).join(brachyd.port);
      } catch (const UserError&) {  // nothing listens
        return false;
      }
    };
    return wait_until(joins, [] { std::this_thread::yield(); });
  }
  std::string refusal(RunningBrachyd& brachyd, const std::string& file, const std::string& trainee,
                      net::Role role = net::Role::kOperator) {
    Peer peer(role);
    EXPECT_TRUE(peer.join(brachyd.port));
    peer.client.send(net::ExerciseMessage{file, trainee});
    EXPECT_TRUE(peer.until([&] { return !peer.errors.empty(); }));
    EXPECT_TRUE(peer.closed.empty());
    return peer.errors.empty() ? "" : peer.errors.front().text;
  }
  SessionManifest manifest_of(const std::string& attempt) const {
    return parse_manifest(read_file(fs::path(sessions) / attempt / "session.json"), attempt);
  }
};

TEST_F(BrachydExercise, EachAttemptIsASessionOfItsOwnAndIsScoredAtItsEnd) {
  RunningBrachyd brachyd(kOneNeedle, {"--sessions", sessions, "--trainee", "Anna"});
  EXPECT_EQ(manifest_of("0001_01_one_needle").trainee, "Anna");
  begin(brachyd, "01_one_needle.toml", "Bert");
  ASSERT_TRUE(comes_back(brachyd));
  const auto report = nlohmann::json::parse(read_file(fs::path(sessions) / "0001_01_one_needle/report.json"));
  EXPECT_EQ(report.at("exercise").at("passed"), false);
  EXPECT_EQ(report.at("about").at("trainee"), "Anna");
  EXPECT_EQ(manifest_of("0002_01_one_needle").trainee, "Bert");
  begin(brachyd, "02_one_train.toml", "");
  ASSERT_TRUE(comes_back(brachyd));
  const SessionManifest third = manifest_of("0003_02_one_train");
  EXPECT_EQ(third.trainee, "");
  ASSERT_TRUE(third.exercise);
  EXPECT_EQ(fs::path(third.exercise->file).filename(), "02_one_train.toml");
  EXPECT_EQ(fs::path(third.scene.file).filename(), "02_one_train.toml");
  brachyd.process.send_signal(SIGTERM);
  EXPECT_TRUE(exited(brachyd.process.wait(), 0));
  EXPECT_TRUE(fs::exists(fs::path(sessions) / "0003_02_one_train/report.html"));
}

TEST_F(BrachydExercise, WhatCannotBeginIsRefusedAndNothingEnds) {
  RunningBrachyd brachyd(kOneNeedle, {"--sessions", sessions});
  EXPECT_EQ(refusal(brachyd, "../../secret.toml", ""),
            "there is no exercise \"../../secret.toml\" with this scene");
  EXPECT_NE(refusal(brachyd, "01_one_needle.toml", "", net::Role::kViewer)
                .find("only a client with the role operator"),
            std::string::npos);
  EXPECT_EQ(std::distance(fs::directory_iterator(sessions), {}), 1);
  RunningBrachyd without(kOneNeedle);
  EXPECT_EQ(refusal(without, "01_one_needle.toml", ""),
            "no attempt can be recorded: start brachyd with --sessions DIR");
}

// They show trainees and what they did.
TEST_F(BrachydExercise, TheTeachersPagesAreServedToAnOperatorsTokenOnly) {
  {
    RunningBrachyd first(kOneNeedle, {"--sessions", sessions, "--trainee", "Anna"});
    begin(first, "01_one_needle.toml", "Anna");
    ASSERT_TRUE(comes_back(first));
    first.process.send_signal(SIGTERM);
    EXPECT_TRUE(exited(first.process.wait(), 0));
  }
  const auto token = [&](const std::string& name) {
    EXPECT_TRUE(exited(run_brachy({"token", (folder / name).string()}), 0));
    return (folder / name).string();
  };
  const std::string any = token("any.token"), viewer = token("viewer.token"), other = token("other.token");
  RunningBrachyd brachyd(folder.write("scene.toml", small_scene("http_port = 0\ntoken_file = \"any.token\"\n"
                                                                "viewer_token_file = \"viewer.token\"\n")),
                         {"--sessions", sessions});
  const std::uint16_t port = http_port(brachyd);
  ASSERT_NE(port, 0);
  const auto with_token = [](const std::string& file) {
    return "Authorization: Bearer " + net::to_hex(net::load_token(file)) + "\r\n";
  };
  for (const std::string page :
       {"/class.html", "/class.csv", "/sessions", "/sessions/0001_01_one_needle/report.json"}) {
    for (const std::string& more : {std::string(), with_token(other), with_token(viewer)}) {
      const std::string refused = http_get(port, page, more);
      EXPECT_TRUE(refused.starts_with("HTTP/1.1 401 ")) << page << ": " << refused.substr(0, 200);
      EXPECT_EQ(refused.find("Anna"), std::string::npos) << page;
    }
    std::string served;
    const auto is_read = [&] {  // 202: not yet
      served = http_get(port, page, with_token(any));
      return !served.starts_with("HTTP/1.1 202 ");
    };
    EXPECT_TRUE(wait_until(is_read, [] { std::this_thread::sleep_for(kTurn); })) << page;
    EXPECT_TRUE(served.starts_with("HTTP/1.1 200 ")) << page << ": " << served.substr(0, 200);
    EXPECT_NE(served.find("Anna"), std::string::npos) << page;
  }
}

// A signal between one attempt and the next is not lost.
TEST_F(BrachydExercise, ASignalInBetweenEndsIt) {
  RunningBrachyd brachyd(kOneNeedle, {"--sessions", sessions});
  begin(brachyd, "01_one_needle.toml", "");
  brachyd.process.send_signal(SIGTERM);
  EXPECT_TRUE(exited(brachyd.process.wait(), 0));
}

TEST_F(BrachydExercise, AnAttemptThatCannotBeRecordedLeavesTheSceneRunning) {
  RunningBrachyd brachyd(kOneNeedle, {"--sessions", sessions});
  // Taken after the number was chosen: a file in the way of the directory.
  fs::create_directories(fs::path(sessions) / "0006_x");
  folder.write("class/0007_01_one_needle", "in the way");
  begin(brachyd, "01_one_needle.toml", "");
  ASSERT_TRUE(comes_back(brachyd));
  EXPECT_TRUE(fs::exists(fs::path(sessions) / "0008_01_one_needle/session.json")) << "a number of its own";
}

// The exercise's scene says nothing of tokens: those of the scene that was named hold on, wherever their file lies.
TEST_F(BrachydExercise, TokensAreAskedForInEveryRun) {
  const std::string token = (folder / "secret").string();
  ASSERT_TRUE(exited(run_brachy({"token", token}), 0));
  fs::create_directory_symlink(fs::path(BRACHY_SOURCE_DIR) / "config/exercises", folder / "exercises");
  RunningBrachyd brachyd(folder.write("scene.toml", small_scene("token_file = \"secret\"\n")),
                         {"--sessions", sessions});
  net::ClientOptions trusted;
  trusted.role = net::Role::kOperator;
  trusted.token = net::load_token(token);
  const auto is_refused = [&] {
    Peer stranger(net::Role::kOperator);
    stranger.connect(brachyd.port);
    return stranger.until([&] { return !stranger.errors.empty() || stranger.welcomed; }) &&
           !stranger.welcomed && stranger.errors.front().code == net::ErrorCode::kUnauthorised;
  };
  EXPECT_TRUE(is_refused());
  {
    Peer boss(trusted);
    ASSERT_TRUE(boss.join(brachyd.port));
    boss.client.send(net::ExerciseMessage{"01_one_needle.toml", ""});
    ASSERT_TRUE(boss.until([&] { return !boss.closed.empty(); }));
  }
  ASSERT_TRUE(comes_back(brachyd, trusted));
  EXPECT_TRUE(fs::exists(fs::path(sessions) / "0001_01_one_needle/session.json"));
  EXPECT_TRUE(is_refused());
}

}  // namespace
}  // namespace brachy
