// The viewer's output for arbitrary states: a server in this process, the tool as a child process.
#include <gtest/gtest.h>

#include <csignal>
#include <limits>

#include "apps/terminal/terminal.h"
#include "test_paths.h"
#include "tests/apps/served_states.h"
#include "tests/apps/terminal/pseudo_terminal.h"

namespace brachy {
namespace {

using namespace test;

struct WatchedStates : ServedStates {
  explicit WatchedStates(std::vector<std::string> more = {}) { start({"watch"}, std::move(more)); }
  Ended end() { return ServedStates::end().front(); }
};

void show_one_of_each(WatchedStates& states) {
  states.show([](MeshState&) {});
  states.show([](MeshState& s) {
    s.summary.step_flags = kStepSubstepped | kStepClamped;
    s.summary.certificate.det_bound = 0.25;
    s.summary.certificate.vertex_det = 0.5;
    s.summary.certificate.substeps = 3;
    s.summary.certificate.held_mm = 2.125;
    s.summary.certificate.condition = 2000;
  });
  states.show([](MeshState& s) {
    s.summary.step_flags = kStepFolded;
    s.summary.certificate.verdict = Verdict::kFolded;
    s.summary.certificate.det_bound = Certificate::kNotKnown;
    s.summary.certificate.vertex_det = -0.5;
  });
  states.show([](MeshState& s) {
    s.summary.step_flags = kStepUncertified;
    s.summary.certificate.verdict = Verdict::kUnknown;
    s.summary.certificate.det_bound = Certificate::kNotKnown;
    s.summary.certificate.vertex_det = Certificate::kNotKnown;
  });
}

TEST(Watch, CountsFramesByVerdictAndByGuard) {
  WatchedStates states({"--json"});
  show_one_of_each(states);
  const Ended ended = states.end();
  ASSERT_TRUE(exited(ended, 0));
  const auto json = json_of(ended);
  ASSERT_FALSE(json.is_discarded()) << ended.out;
  EXPECT_EQ(json.at("snapshots"), 4);
  EXPECT_EQ(json.at("frames_injective"), 2);
  EXPECT_EQ(json.at("frames_folded"), 1);
  EXPECT_EQ(json.at("frames_unknown"), 1);
  EXPECT_EQ(json.at("frames_unflagged"), 0);
  EXPECT_EQ(json.at("frames_substepped"), 1);
  EXPECT_EQ(json.at("frames_clamped"), 1);
  EXPECT_EQ(json.at("min_det_bound"), 0.25);
  EXPECT_EQ(json.at("min_vertex_det"), -0.5);
  EXPECT_EQ(json.at("max_substeps"), 3);
  EXPECT_EQ(json.at("max_held_mm"), 2.125);
  EXPECT_EQ(json.at("max_condition"), 2000);
  EXPECT_EQ(json.at("nonfinite"), 0);
}

TEST(Watch, TellsHowFarNeedlesBend) {
  const auto bend = [](MeshState& s) {
    s.summary.step_flags = kStepSteep;
    s.needles.states.resize(1);
    s.needles.states[0].present = true;
    s.needles.states[0].shape.is_bent = true;
    s.needles.states[0].shape.tip_deflection = Vec3(3, 4, 0);
  };
  WatchedStates states({"--json"});
  states.show(bend);
  const auto json = json_of(states.end());
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(json.at("max_tip_deflection_mm"), 5);
  EXPECT_EQ(json.at("frames_steep"), 1);
  WatchedStates people;
  people.show(bend);
  const Ended ended = people.end();
  for (const char* part : {"tip deflected by at most 5.00 mm", "1 with a needle bent by more than 8°"})
    EXPECT_NE(ended.out.find(part), std::string::npos) << part << "\n" << ended.out;
}

TEST(Watch, TellsTheLargestLagOfTheTissue) {
  const auto show_late = [](WatchedStates& states) {
    for (const double lag_mm : {0.125, 0.5, 0.25})
      states.show([&](MeshState& s) {
        s.summary.step_flags = kStepLate;
        s.summary.lag_mm = lag_mm;
      });
  };
  WatchedStates states({"--json"});
  show_late(states);
  const auto json = json_of(states.end());
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(json.at("frames_late"), 3);
  EXPECT_EQ(json.at("max_lag_mm"), 0.5);
  WatchedStates people;
  show_late(people);
  const Ended ended = people.end();
  EXPECT_NE(ended.out.find("3 late (tissue at most 0.50 mm behind)"), std::string::npos) << ended.out;
}

TEST(Watch, CountsWhatMustNotBe) {
  WatchedStates states({"--json"});
  states.show([](MeshState& s) { s.summary.certificate.verdict = Verdict::kFolded; });  // without a flag
  states.show([](MeshState& s) { s.mesh.deformed_vertices[8] = std::numeric_limits<float>::quiet_NaN(); });
  states.show([](MeshState& s) { s.mesh.deformed_vertices[0] = std::numeric_limits<float>::infinity(); });
  const auto json = json_of(states.end());
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(json.at("frames_unflagged"), 1);
  EXPECT_EQ(json.at("nonfinite"), 2);
}

TEST(Watch, TellsPeopleTheSame) {
  WatchedStates states;
  show_one_of_each(states);
  states.tell("field folds at (1.0, 2.0, 3.0) mm");
  const Ended ended = states.end();
  ASSERT_TRUE(exited(ended, 0));
  for (const char* part :
       {"frames: 2 injective, 1 folded, 1 unknown; least det: bound 0.250, at vertices -0.500",
        "1 with sub-steps (at most 3), 1 clamped (at most 2.12 mm)",
        "tick 4: field folds at (1.0, 2.0, 3.0) mm"})
    EXPECT_NE(ended.out.find(part), std::string::npos) << part << "\n" << ended.out;
}

const std::string kHome = "\x1b[H";  // begins a screen

/// The screens that were drawn, without the sequence that ends each line.
std::vector<std::vector<std::string>> pictures_of(const std::string& text) {
  std::vector<std::vector<std::string>> pictures;
  constexpr std::string_view kLineEnd = "\x1b[K";
  for (std::size_t at = text.find(kHome); at != text.npos;) {
    const std::size_t next = text.find(kHome, at + 1), from = at + kHome.size();
    std::vector<std::string>& lines = pictures.emplace_back();
    for (std::string& line : lines_of(text.substr(from, next == text.npos ? next : next - from)))
      lines.push_back(line.substr(0, line.find(kLineEnd)));
    at = next;
  }
  return pictures;
}

struct WatchOnATerminal : ::testing::Test {
  void start(const std::vector<std::string>& environment) {
    std::vector<std::string> line = {"/usr/bin/env"};
    line.insert(line.end(), environment.begin(), environment.end());
    line.insert(line.end(), {BRACHY_BINARY, "watch"});
    tool = &states.start_line(line, {}, {terminal.end(), -1});
  }
  /// Serves the tool until it has written `part`, at or after `from`.
  bool until(const std::string& part, std::size_t from = 0) {
    return wait_until([&] { return terminal.read().find(part, from) != std::string::npos; },
                      [this] { states.serve(); });
  }
  void show_a_needle() {
    states.show([](MeshState& s) {
      s.needles.states.resize(1);
      s.needles.states[0].present = true;
      s.needles.states[0].contact = ContactState::kInserted;
      s.needles.states[0].insertion_depth_mm = 12;
      s.needles.states[0].forces.axial_n = 2;
    });
  }
  PseudoTerminal terminal{80, 24};
  ServedStates states;
  ChildProcess* tool = nullptr;
};

TEST_F(WatchOnATerminal, RedrawsInPlaceFollowsItsSizeAndGivesTheTerminalBack) {
  start({"TERM=xterm", "NO_COLOR="});
  show_a_needle();
  ASSERT_TRUE(until("inserted   12.0 of 40 mm deep"));
  EXPECT_TRUE(terminal.read().starts_with("\x1b[?1049h\x1b[?25l"));
  EXPECT_NE(terminal.read().find("\x1b[32m"), std::string::npos);
  for (const auto& picture : pictures_of(terminal.read())) {
    EXPECT_LE(picture.size(), 24u);
    for (const std::string& line : picture) EXPECT_LE(columns_of(line), 80u) << line;
  }
  states.tell("field folds at (1.0, 2.0, 3.0) mm");
  ASSERT_TRUE(until("tick 1: field folds"));
  terminal.resize(50, 12);
  std::size_t second = 0;
  // The first picture after it may have been begun before it, the second has been written in full when the third
  // begins.
  std::size_t first = terminal.read().size();
  for (int picture = 0; picture < 3; ++picture) {
    ASSERT_TRUE(until(kHome, first + 1));
    first = terminal.read().find(kHome, first + 1);
    if (picture == 1) second = first;
  }
  const auto pictures = pictures_of(terminal.read().substr(second, first - second));
  ASSERT_EQ(pictures.size(), 1u);
  EXPECT_LE(pictures.back().size(), 12u);
  for (const std::string& line : pictures.back()) EXPECT_LE(columns_of(line), 50u) << line;

  tool->send_signal(SIGINT);
  ASSERT_TRUE(until("watch: "));
  ASSERT_TRUE(exited(states.end().front(), 0));
  const std::string text = terminal.read();
  const std::size_t back = text.find("\x1b[?25h\x1b[?1049l");
  ASSERT_NE(back, text.npos);
  EXPECT_GT(text.find("watch: "), back);
  EXPECT_EQ(text.find('\x1b', back + 14), text.npos) << text.substr(back);
}

TEST_F(WatchOnATerminal, UsesNoColourWhereNoneIsWanted) {
  start({"TERM=xterm", "NO_COLOR=1"});
  show_a_needle();
  ASSERT_TRUE(until("inserted   12.0 of 40 mm deep"));
  EXPECT_EQ(terminal.read().find("m▕"), std::string::npos);
  states.end();
}

TEST_F(WatchOnATerminal, ADumbOneGetsTheLinesThatAFileGets) {
  start({"TERM=dumb"});
  show_a_needle();
  ASSERT_TRUE(until("inserted   depth  12.0 mm"));
  ASSERT_TRUE(exited(states.end().front(), 0));
  EXPECT_EQ(terminal.read().find('\x1b'), std::string::npos);
  EXPECT_NE(terminal.read().find("watch: "), std::string::npos);
}

}  // namespace
}  // namespace brachy
