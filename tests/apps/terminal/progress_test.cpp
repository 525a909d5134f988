#include "apps/terminal/progress.h"

#include <gtest/gtest.h>

#include <limits>

#include "test_paths.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/terminal/pseudo_terminal.h"

namespace brachy {
namespace {

using namespace test;

TEST(ProgressText, SaysShareTimeLeftAndWhatIsDone) {
  ProgressText text("compare", true);
  EXPECT_EQ(text.at(0, 0, "a"), "compare: 0 %, a");
  EXPECT_EQ(text.at(2, 0.25, "b"), "compare: 25 %, 6 s left, b");
  EXPECT_EQ(text.at(100, 0.5, ""), "compare: 50 %, 1 min 40 s left");
  EXPECT_EQ(text.at(101, 0.999, ""), "compare: 99 %, 1 s left");
  EXPECT_EQ(text.at(102, 7, ""), "compare: 100 %, 0 s left");
  EXPECT_EQ(text.at(125, std::numeric_limits<double>::quiet_NaN(), "9 snapshots"),
            "compare: 2 min 5 s, 9 snapshots");
}

TEST(ProgressText, RedrawsTenTimesASecondAndPrintsEveryFiveSeconds) {
  const auto lines_in_20_s = [](bool is_redrawn) {
    ProgressText text("deform", is_redrawn);
    int lines = 0;
    for (int ms = 0; ms < 20'000; ++ms) lines += text.at(1e-3 * ms, 0.5, "").has_value();
    return lines;
  };
  EXPECT_LE(lines_in_20_s(true), 200);
  EXPECT_GE(lines_in_20_s(true), 150);
  EXPECT_EQ(lines_in_20_s(false), 3);  // and nothing at first: a quick command prints nothing
}

TEST(ProgressText, TellsDurationsAsPeopleDo) {
  EXPECT_EQ(duration_text(0), "0 s");
  EXPECT_EQ(duration_text(59.2), "1 min 0 s");
  EXPECT_EQ(duration_text(7500), "2 h 5 min");
}

// A terminal gets one line that is redrawn and removed; a file gets nothing from a quick command.
TEST(Progress, IsDrawnOnATerminalAndLeavesNothingBehind) {
  const TempFolder folder;
  const std::vector<std::string> quick = {"deform",
                                          "--landmarks",
                                          folder.write("l.csv", "x,y,z,dx,dy,dz\n0,0,0,0,0,1\n"),
                                          "--points",
                                          folder.write("p.csv", "x,y,z\n1,2,3\n"),
                                          "--out",
                                          (folder / "o.csv").string(),
                                          "--support",
                                          "12",
                                          "--force"};
  const auto with_term = [&](const std::string& term) {
    std::vector<std::string> line = {"/usr/bin/env", "TERM=" + term, BRACHY_BINARY};
    line.insert(line.end(), quick.begin(), quick.end());
    return line;
  };
  PseudoTerminal terminal(40, 24);
  ChildProcess on_terminal(with_term("xterm"), {-1, terminal.end()});
  std::string shown;
  ASSERT_TRUE(exited(on_terminal.wait(), 0));
  shown = terminal.read();
  EXPECT_TRUE(shown.starts_with("\r\x1b[Kdeform: 0 %, ")) << shown;
  EXPECT_TRUE(shown.ends_with("\r\x1b[K")) << shown;
  EXPECT_EQ(shown.find('\n'), std::string::npos);
  EXPECT_EQ(run_brachy(quick).err, "");
  PseudoTerminal dumb(40, 24);
  ChildProcess on_dumb(with_term("dumb"), {-1, dumb.end()});
  ASSERT_TRUE(exited(on_dumb.wait(), 0));
  EXPECT_EQ(dumb.read().find('\x1b'), std::string::npos);
}

}  // namespace
}  // namespace brachy
