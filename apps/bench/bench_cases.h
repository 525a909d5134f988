#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace brachy::bench {

/// A whole tick: `landmarks` landmarks of `kernel`, over `points` points.
struct TickCase {
  std::size_t points, landmarks;
  std::string_view kernel = "psi31";
  double support_mm = 12;
  int threads = 1;
};

/// Needles in the gland, of which the last `stirred` go round.
struct InPlaceCase {
  std::string_view name;
  std::size_t count, stirred;
};

/// What differs between the short form of the benchmarks and the long one.
struct BenchCases {
  std::vector<TickCase> ticks;  ///< each with moving landmarks and with fixed ones
  std::vector<std::size_t> reaction_landmarks;
  std::vector<InPlaceCase> in_place;
  std::size_t dose_points;  ///< at random in the gland, where the exact dose is known
  std::vector<double> dose_spacings_mm;
};

/// Only what the goals and the charts need, in under three minutes.
BenchCases short_cases();

}  // namespace brachy::bench
