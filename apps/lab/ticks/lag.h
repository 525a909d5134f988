#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace brachy {

/// Needles on a square of holes 8 mm apart about the gland's axis: `resting` are in place, 55 mm past the hand's start,
/// and `moving` beside them are inserted at 50 mm/s, or in place too and stirred ±5 mm across at 6 Hz.
struct LagScenario {
  std::string name;
  std::size_t resting = 0, moving = 1;
  bool is_inserted = false;
  double rate_hz = 200;
  std::uint64_t points = 0;  ///< of the phantom; 0: the default's
};

/// Those of the lag's table: 1, 2, 3, 4 and 16 needles stirred, one inserted or stirred beside 16, 1 kHz, 100,000
/// points.
std::vector<LagScenario> lag_scenarios();

/// What ticks of `elastic` show while the needles move, against whole ticks of the same poses (WorkBudget::is_whole).
struct LagRow {
  LagScenario scenario;
  std::size_t landmarks = 0;
  std::uint64_t ticks = 0, late = 0, unknown = 0, clamped = 0;
  double max_mm = 0, p99_mm = 0, mean_mm = 0;  ///< of each tick's farthest point
  double told_mm = 0;                          ///< largest TickSummary::lag_mm
  double missed_mm = 0;  ///< largest |u(p_i) − d_i| at a landmark, of ticks with a field of their own
  double p50_ms = 0, p99_ms = 0;  ///< a tick's processor time, on one thread
};
LagRow measure_lag(const LagScenario& scenario);

/// Writes scene and trajectory of the scenario, DIR/NAME.toml and DIR/NAME.csv, for a daemon.
/// Errors: std::runtime_error names what cannot be written.
void write_lag_scenario(const LagScenario& scenario, const std::filesystem::path& folder);

std::string to_json(const std::vector<LagRow>& rows);
std::string to_markdown(const std::vector<LagRow>& rows);

}  // namespace brachy
