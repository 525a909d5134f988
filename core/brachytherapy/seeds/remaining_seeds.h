#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/seeds/seed.h"

namespace brachy {

/// The planned seeds that have not left their needles: what a plan that is made again for the rest may still place.
/// `planned`: Plan::seeds; `fallen`: in the body; `lost`: indices of planned seeds that fell outside it. In the plan's
/// order. Seeds that are in no plan take none away.
inline std::vector<PlannedSeed> remaining_seeds(std::span<const PlannedSeed> planned,
                                                std::span<const Seed> fallen,
                                                std::span<const std::int32_t> lost = {}) {
  std::vector<char> is_gone(planned.size(), 0);
  const auto take = [&](std::int32_t index) {
    if (index >= 0 && static_cast<std::size_t>(index) < planned.size())
      is_gone[static_cast<std::size_t>(index)] = 1;
  };
  for (const Seed& seed : fallen) take(seed.planned);
  for (const std::int32_t index : lost) take(index);
  std::vector<PlannedSeed> rest;
  for (std::size_t i = 0; i < planned.size(); ++i)
    if (!is_gone[i]) rest.push_back(planned[i]);
  return rest;
}

}  // namespace brachy
