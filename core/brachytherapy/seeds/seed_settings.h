#pragma once

#include <string>

#include "core/brachytherapy/dose/dose_seed.h"

namespace brachy {

/// How a device's needle drops seeds, and their source.
struct SeedSettings {
  static constexpr int kMaxCount = 4096;

  /// "single": each press of the button drops one seed at the tip. "train": at a press the plan's train of the nearest
  /// hole is held in the world, and as the tip is drawn back past each seed that one falls.
  std::string applicator = "single";
  SourceModel source = SourceModel::kAmersham6711;  ///< of unplanned seeds
  double air_kerma_strength_u = 0.5;                ///< of each of those
  int max_count = 256;                              ///< in the tissue at once, 1 … kMaxCount
  /// What a needle of "train" carries when it is taken up. "hole": the train that the plan has for the hole it goes
  /// through, or, in a hole that the plan leaves free, the plan's first untouched one. "order": always the plan's first
  /// untouched one, as an assistant hands them out.
  std::string loading = "hole";

  bool operator==(const SeedSettings&) const = default;
};

}  // namespace brachy
