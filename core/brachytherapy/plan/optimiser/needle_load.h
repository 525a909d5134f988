#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/brachytherapy/plan/plan.h"

namespace brachy {

/// A needle's depth and train while they are being chosen: a value of a few bytes, without allocation.
///
/// Seeds lie where plan files can put them: the tip stops at a whole number of mm beyond the template, and behind it
/// come seeds of 4.5 mm and spacers of 5.5 mm. A seed's centre is then at row/2 − 2.25 mm beyond the template for a
/// whole `row`, which numbers the rows of DoseRows.
struct NeedleLoad {
  static constexpr int kMostElements = 24;  ///< seeds and spacers of one train

  int tip_mm = 0;           ///< beyond the template
  int elements = 0;         ///< of the train; 0: the needle is not used
  std::uint32_t seeds = 0;  ///< bit e: element e, from the tip backwards, is a seed, else a spacer

  bool is_used() const { return seeds != 0; }
  bool is_seed(int element) const { return (seeds >> element & 1) != 0; }
  int seed_count() const { return __builtin_popcount(seeds); }
  double length_mm() const;
  /// Each seed's row, from the tip backwards; returns how many there are.
  int seed_rows(std::array<int, kMostElements>& rows) const;
  /// Removes spacers behind the last seed; those in front of the first one become depth where that is whole mm.
  void trim();

  std::string train() const;  ///< as PlanNeedle has it
  /// Errors: asserts that the tip is at a whole mm and the train has at most kMostElements.
  static NeedleLoad from(int tip_mm, const std::string& train);

  bool operator==(const NeedleLoad&) const = default;
};

/// A seed's centre beyond the template, mm, for its row.
inline double row_depth_mm(int row) {
  return 0.5 * row - 0.5 * PlanNeedle::kSeedMm;
}

}  // namespace brachy
