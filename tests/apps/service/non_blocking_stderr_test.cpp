// The log on a pipe whose reader stalls: nothing blocks, and lines about safety are kept.
#include "apps/daemon/service/non_blocking_stderr.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <memory>

#include "apps/daemon/network_log.h"
#include "apps/daemon/service/stderr_sink.h"
#include "tests/apps/child_process.h"
#include "tests/net/manual_clock.h"

namespace brachy {
namespace {

using test::FileDescriptor, test::lines_of;

struct NonBlockingStderrTest : ::testing::Test {
  NonBlockingStderrTest() {
    int ends[2];
    EXPECT_EQ(pipe2(ends, O_CLOEXEC), 0);
    read_end.reset(ends[0]);
    write_end.reset(ends[1]);
    fcntl(read_end.get(), F_SETFL, O_NONBLOCK);
    err = std::make_unique<NonBlockingStderr>(write_end.get());
  }
  void print(const std::string& line) { err->sputn(line.data(), static_cast<std::streamsize>(line.size())); }
  /// Lines of the network until some are dropped.
  void fill() {
    const std::string line(1000, '.');
    for (int i = 0; i < 100; ++i) print(line + "\n");
  }
  /// What the reader gets, except the dots.
  std::vector<std::string> read_all() {
    std::string text, piece(65536, '\0');
    for (ssize_t size = 0; (size = read(read_end.get(), piece.data(), piece.size())) > 0;)
      text.append(piece.data(), static_cast<std::size_t>(size));
    std::vector<std::string> lines = lines_of(text);
    std::erase_if(lines, [](const std::string& line) { return line.find_first_not_of('.') == line.npos; });
    return lines;
  }

  FileDescriptor read_end, write_end;
  std::unique_ptr<NonBlockingStderr> err;
};

TEST_F(NonBlockingStderrTest, LinesAboutSafetyWaitForTheReaderAndOthersAreCounted) {
  fill();
  for (int i = 0; i < 3; ++i) {
    err->write_safety("safety " + std::to_string(i) + "\n");
    print("another\n");
  }
  EXPECT_TRUE(read_all().empty());
  err->update();
  const auto lines = read_all();
  ASSERT_EQ(lines.size(), 4u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(lines[i], "safety " + std::to_string(i));
  EXPECT_TRUE(lines[3].ends_with(" lines of the log dropped: its reader stalled")) << lines[3];
  err->update();
  print("as before\n");
  EXPECT_EQ(read_all(), std::vector<std::string>{"as before"});
}

TEST_F(NonBlockingStderrTest, AReaderThatGoesOnSlowlyGetsEveryLineAboutSafetyOnce) {
  fill();
  const std::string text(900, 's');
  for (int i = 0; i < 500; ++i) err->write_safety(std::to_string(i) + text + "\n");
  std::string all, piece(3000, '\0');
  for (int rounds = 0; rounds < 1000; ++rounds) {
    if (const ssize_t size = read(read_end.get(), piece.data(), piece.size()); size > 0)
      all.append(piece.data(), static_cast<std::size_t>(size));
    err->update();
  }
  std::vector<std::string> lines = lines_of(all);
  std::erase_if(lines, [&](const std::string& line) { return !line.ends_with(text); });
  ASSERT_EQ(lines.size(), 500u);
  for (std::size_t i = 0; i < lines.size(); ++i) EXPECT_EQ(lines[i], std::to_string(i) + text);
}

TEST_F(NonBlockingStderrTest, MoreThanItKeepsAreCounted) {
  fill();
  for (std::size_t i = 0; i < NonBlockingStderr::kMostWaiting + 7; ++i) err->write_safety("safety\n");
  std::size_t kept = 0;
  std::vector<std::string> lines;
  do {
    lines = read_all();
    kept += static_cast<std::size_t>(std::ranges::count(lines, "safety"));
    err->update();
  } while (lines.empty() || lines.back() == "safety");
  EXPECT_EQ(kept, NonBlockingStderr::kMostWaiting);
  EXPECT_NE(lines.back().find(" lines of the log dropped, 7 about safety: its reader stalled"),
            std::string::npos)
      << lines.back();
}

TEST_F(NonBlockingStderrTest, TheLogKnowsWhichLinesAreAboutSafety) {
  const auto default_logger = spdlog::default_logger();
  const auto sink = std::make_shared<StderrSink>(*err);
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", sink));
  spdlog::register_logger(std::make_shared<spdlog::logger>(kSafetyLogger, sink));
  fill();
  net::test::ManualClock clock;
  NetworkLog log(clock);
  log.info("client 1 joined");
  log.safety("safety: device lost in contact");
  read_all();
  spdlog::default_logger_raw()->flush();
  const auto lines = read_all();
  spdlog::drop(kSafetyLogger);
  spdlog::set_default_logger(default_logger);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_TRUE(lines[0].ends_with("safety: device lost in contact")) << lines[0];
}

}  // namespace
}  // namespace brachy
