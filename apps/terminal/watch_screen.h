#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "apps/terminal/bars.h"
#include "apps/terminal/terminal.h"

namespace brachy {

/// The screen of `brachy watch`: plain values, filled in by the caller. NaN: not known.
struct WatchScreen {
  struct Needle {
    std::uint32_t id = 0;
    std::string contact;  ///< the contact state, or "no needle"
    double depth_mm = 0, axial_n = 0, lateral_n = 0;
    double tip_deflection_mm = 0;  ///< 0: not bent
    std::uint32_t punctures = 0;
    ValueHistory axial;  ///< marked at punctures
  };

  std::string server, address, model, device;  ///< empty: not known
  double silence_s = 0;                        ///< since the last frame
  double sim_time_s = 0, ticks_hz = 0, period_ms = 0;
  std::uint64_t ticks = 0, overruns = 0;
  double tick_p50_ms = 0, tick_p99_ms = 0;
  double latency_p50_ms = 0, latency_p99_ms = 0;  ///< from a pose to this client
  double frames_hz = 0, bytes_per_s = 0;
  std::uint64_t dropped = 0, gaps = 0;
  std::string verdict;  ///< of the field, with its det
  ValueHistory det;
  double displacement_mm = 0;
  std::uint32_t moved = 0;
  ValueHistory displacement;
  std::vector<Needle> needles;
  std::uint32_t seeds = 0;
  std::string dose_name;  ///< of the structure; empty: no dose was received
  double v100_percent = 0, d90_gy = 0, prescription_gy = 0;
  std::deque<std::string> events;  ///< the newest last
};

/// Its lines, none wider than the terminal and not more than it has rows: what does not fit is omitted from below, the
/// oldest events first. With `colour`: a fold or a missed deadline in red, and so on; the text is the same without.
std::vector<std::string> render(const WatchScreen& screen, TerminalSize size, bool colour);

}  // namespace brachy
