// The teacher's pages, of sessions that others wrote.
#include "apps/daemon/exercise/session_pages.h"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/score/class_table.h"
#include "apps/score/history.h"
#include "apps/session/session_manifest.h"
#include "core/base/version.h"
#include "tests/apps/apps_testing.h"
#include "tests/net/manual_clock.h"

namespace brachy {
namespace {

using namespace test;
using Content = net::DynamicPage::Content;

struct SessionPagesTest : ::testing::Test {
  net::test::ManualClock clock;
  EventLoop loop{clock};
  TempFolder folder;

  void write_attempt(const std::string& name, const std::string& trainee, bool is_scored) const {
    SessionManifest manifest;
    manifest.trainee = trainee;
    manifest.exercise = ManifestText{"e.toml", "name = \"the apex\"\n"};
    manifest.runs = {{"1", "2026-11-01T10:00:00Z", "", 0}};
    std::filesystem::create_directories(folder / name);
    folder.write(name + "/session.json", to_json(manifest));
    folder.write(name + "/recording_0.brachy", "the recording of " + name);
    folder.write(name + "/poses.csv", "t_s\n");
    if (is_scored)
      folder.write(
          name + "/report.json",
          R"({"exercise":{"name":"the apex","passed":false,"lines":[]},"findings":[{"text":"too deep"}]})");
  }

  /// The answer once it has been read.
  Content answer(net::DynamicPages& pages, const std::string& page, const std::string& below = {}) {
    Content content;
    EXPECT_TRUE(wait_until(
        [&] {
          content = below.empty() ? pages.at(page).make() : pages.at(page).make_below(below);
          return content.status != 202;
        },
        [&] {
          loop.io().restart();
          loop.io().poll();
          std::this_thread::yield();
        }));
    if (content.shared) content.text = *content.shared;
    return content;
  }
};

TEST_F(SessionPagesTest, AreForOperators) {
  SessionPages sessions(loop, folder / "", [] {});
  for (const auto& [path, page] : sessions.pages())
    EXPECT_EQ(page.access, net::DynamicPage::Access::kOperator) << path;
}

TEST_F(SessionPagesTest, TheClassIsThatOfTheTool) {
  write_attempt("0001_apex", "Anna", true);
  SessionPages sessions(loop, folder / "", [] {});
  auto pages = sessions.pages();
  const History history = load_class(folder / "");
  EXPECT_EQ(pages.at("/class.html").make().status, 202);
  EXPECT_EQ(answer(pages, "/class.html").text, to_html(history, "", version()));
  EXPECT_EQ(answer(pages, "/class.csv").text, to_csv(class_table(history)));
}

TEST_F(SessionPagesTest, AreReadAgainAfterFiveSeconds) {
  SessionPages sessions(loop, folder / "", [] {});
  auto pages = sessions.pages();
  EXPECT_EQ(answer(pages, "/class.html").status, 404) << "nothing is scored";
  write_attempt("0001_apex", "Anna", true);
  EXPECT_EQ(answer(pages, "/class.html").status, 404);
  clock.advance(std::chrono::seconds(5));
  EXPECT_EQ(answer(pages, "/class.html").status, 200);
}

TEST_F(SessionPagesTest, TheListHasAllSessionsAlsoThoseThatAreNotScored) {
  write_attempt("0001_apex", "Anna", true);
  write_attempt("0002_apex", "Bert", false);
  write_attempt("cleo/first", "", true);
  SessionPages sessions(loop, folder / "", [] {});
  auto pages = sessions.pages();
  const auto list = nlohmann::json::parse(answer(pages, "/sessions").text).at("sessions");
  ASSERT_EQ(list.size(), 3u);
  EXPECT_EQ(list[0].at("session"), "0001_apex");
  EXPECT_EQ(list[0].at("trainee"), "Anna");
  EXPECT_EQ(list[0].at("passed"), false);
  EXPECT_EQ(list[0].at("findings"), nlohmann::json::array({"too deep"}));
  EXPECT_EQ(list[0].at("recordings").at(0).at("file"), "recording_0.brachy");
  EXPECT_EQ(list[1].at("passed"), nullptr);
  EXPECT_EQ(list[1].at("report"), nullptr);
  EXPECT_EQ(list[1].at("trainee"), "Bert");
  EXPECT_EQ(list[2].at("session"), "cleo/first");
  EXPECT_EQ(list[2].at("trainee"), "cleo");
}

TEST_F(SessionPagesTest, ServesWhatADebriefNeedsAndNothingElse) {
  write_attempt("0001_apex", "Anna", true);
  write_attempt("Anna & Bert/1", "", true);
  folder.write("secret", "not to be read");
  SessionPages sessions(loop, folder / "", [] {});
  auto pages = sessions.pages();
  const auto file = [&](const std::string& below) { return answer(pages, "/sessions/", below); };
  EXPECT_EQ(file("0001_apex/recording_0.brachy").text, "the recording of 0001_apex");
  EXPECT_EQ(file("Anna%20%26%20Bert/1/recording_0.brachy").text, "the recording of Anna & Bert/1");
  EXPECT_EQ(file("0001_apex/report.json").content_type, "application/json");
  for (const char* other :
       {"0001_apex/poses.csv", "0001_apex/session.json", "secret", "0001_apex/../secret",
        "0001_apex/recording_9.brachy", "..%2Fsecret", "%2e%2e/secret", "0001_apex%2F..%2Fsecret/report.json",
        "%", "%4", "%zz", "0001_apex", "0001_apex/recording_%2e%2e%2f%2e%2e%2fsecret.brachy"})
    EXPECT_EQ(file(other).status, 404) << other;
}

}  // namespace
}  // namespace brachy
