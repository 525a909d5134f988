#include "apps/terminal/watch_screen.h"

#include <gtest/gtest.h>

#include <cmath>

namespace brachy {
namespace {

WatchScreen a_session() {
  WatchScreen s;
  s.server = "brachyd 0.1.0";
  s.address = "127.0.0.1:18950";
  s.model = "psi31, 12 mm";
  s.device = "touch";
  s.sim_time_s = 12.5;
  s.ticks_hz = 200;
  s.ticks = 2500;
  s.period_ms = 5;
  s.tick_p50_ms = 0.24;
  s.tick_p99_ms = 2.5;
  s.latency_p50_ms = 6.8;
  s.latency_p99_ms = 8.8;
  s.frames_hz = 30;
  s.bytes_per_s = 1.61e6;
  s.verdict = "injective det 0.512";
  s.displacement_mm = 5.23;
  s.moved = 3456;
  s.needles.resize(1);
  WatchScreen::Needle& needle = s.needles[0];
  needle.contact = "inserted";
  needle.depth_mm = 30;
  needle.axial_n = -1;
  needle.lateral_n = 0.5;
  needle.punctures = 1;
  needle.tip_deflection_mm = 1.25;
  for (int i = 0; i < 20; ++i) {
    needle.axial.add(0.25 * i, 4 - 0.25 * i, i == 5);
    s.det.add(0.25 * i, 0.5);
    s.displacement.add(0.25 * i, 0.1 * i);
  }
  for (int i = 0; i < 40; ++i) s.events.push_back("  tick " + std::to_string(i) + ": event");
  return s;
}

std::string all(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

bool holds(const std::vector<std::string>& lines, const std::string& part) {
  return all(lines).find(part) != std::string::npos;
}

TEST(WatchScreen, ShowsWhatIsKnown) {
  WatchScreen s = a_session();
  s.seeds = 12;
  s.dose_name = "prostate";
  s.d90_gy = 72.5;
  s.prescription_gy = 145;
  s.v100_percent = 50;
  const auto lines = render(s, {80, 24}, false);
  for (const char* part :
       {"brachyd 0.1.0 at 127.0.0.1:18950   model psi31, 12 mm   device touch",
        "t 12.50 s   200.0 Hz, 0 of 2500 deadlines missed", "30.0 frames/s, 0 dropped, 0 gaps, 1.61 MB/s",
        "tick       p50 0.24  p99 2.50 of 5.00 ms     ▕████████████████▌                ▏",
        "latency    p50 6.8  p99 8.8 of 25 ms", "det J      injective det 0.512",
        "displaced  5.23 mm, 3456 points",
        "needle 0   inserted   30.0 of 40 mm deep     ▕████████████████████████▊",
        "  axial    -1.00 N of ±4, 0.50 N across         ", "▐████│", "1 punctures ▼, tip 1.2 mm off", "▼▆",
        "12 seeds   prostate D90 72.5 of 145 Gy", "V100 50.0 %", "tick 39: event"})
    EXPECT_TRUE(holds(lines, part)) << part << "\n" << all(lines);
}

TEST(WatchScreen, FitsAnyTerminal) {
  WatchScreen s = a_session();
  s.needles.resize(16);
  s.seeds = 3;
  for (std::size_t columns = 1; columns < 150; columns += 7)
    for (std::size_t rows = 1; rows < 60; rows += 3)
      for (const bool colour : {false, true}) {
        const auto lines = render(s, {columns, rows}, colour);
        EXPECT_LE(lines.size(), rows);
        for (const std::string& line : lines) EXPECT_LE(columns_of(line), columns) << line;
      }
  EXPECT_EQ(render(a_session(), {80, 24}, false).size(), 24u);
  EXPECT_TRUE(holds(render(s, {80, 24}, false), "… and 14 more needles"));
  EXPECT_TRUE(holds(render(s, {80, 100}, false), "needle 0"));
}

TEST(WatchScreen, SaysWhenNothingComes) {
  WatchScreen s = a_session();
  EXPECT_FALSE(holds(render(s, {80, 24}, false), "NOTHING"));
  s.silence_s = 3.2;
  EXPECT_TRUE(holds(render(s, {80, 24}, false), "NOTHING for 3 s"));
  EXPECT_FALSE(render(WatchScreen(), {80, 24}, true).empty());  // before anything came
}

TEST(WatchScreen, ColourIsNotNeededToReadIt) {
  WatchScreen s = a_session();
  s.verdict = "folded det -0.1";
  s.overruns = 3;
  const auto plain = render(s, {80, 24}, false), coloured = render(s, {80, 24}, true);
  EXPECT_FALSE(holds(plain, "\x1b"));
  EXPECT_TRUE(holds(coloured, "\x1b[31mfolded det -0.1\x1b[0m"));
  EXPECT_TRUE(holds(coloured, "\x1b[33m3 of 2500 deadlines missed\x1b[0m"));
  ASSERT_EQ(plain.size(), coloured.size());
  for (std::size_t i = 0; i < plain.size(); ++i) EXPECT_EQ(columns_of(plain[i]), columns_of(coloured[i]));
}

TEST(WatchScreen, LeavesOutWhatIsNotKnown) {
  WatchScreen s = a_session();
  s.latency_p50_ms = s.latency_p99_ms = std::nan("");
  s.needles[0].axial_n = INFINITY;
  s.needles[0].depth_mm = INFINITY;
  EXPECT_TRUE(holds(render(s, {80, 24}, false), "latency    p50 –  p99 – of 25 ms"));
}

}  // namespace
}  // namespace brachy
