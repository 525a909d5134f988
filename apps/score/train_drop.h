#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "apps/score/recording.h"
#include "apps/score/seed_score.h"

namespace brachy {

/// How fast a needle was drawn back over its train.
struct TrainDrop {
  std::size_t needle = 0;  ///< index in Plan::needles
  /// mm/s: the fastest way of at least kLeastWayMm between seeds, or from the first seed to the last of a shorter
  /// train, over its time and a tick more, as seeds fall in whole ticks: it was no slower.
  double at_least_mm_s = 0;

  static constexpr double kLeastWayMm = 9, kTickS = 0.005;
};

/// Of each needle of the plan that left two seeds or more, by where and when they fell.
std::vector<TrainDrop> train_drops(const SeedsScore& seeds, std::size_t plan_needles);

/// Needles of the plan whose first seed fell while the force log has the device's needle touching the capsule and not
/// in the tissue; none where there are no forces.
std::vector<std::size_t> unpunctured_needles(const SeedsScore& seeds, std::span<const RecordedForce> forces);

}  // namespace brachy
