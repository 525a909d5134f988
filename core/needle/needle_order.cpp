#include "core/needle/needle_order.h"

#include <algorithm>

namespace brachy {

void NeedleOrder::reserve(std::size_t needles, std::size_t landmarks_of_one) {
  changed_.assign(needles, 0);
  places_.resize(needles);
  for (std::vector<Place>& places : places_) places.reserve(landmarks_of_one);
  order_.reserve(needles);
}

void NeedleOrder::update(std::span<const NeedleContact> contacts, const WorkBudget& budget) noexcept {
  ++update_;
  order_.clear();
  std::size_t in_tissue = 0;
  for (std::uint32_t n = 0; n < contacts.size(); ++n) {
    const auto landmarks = contacts[n].landmarks();
    const bool stays =
        std::ranges::equal(landmarks, places_[n], [](const NeedleLandmark& landmark, const Place& place) {
          return landmark.position == place.position && landmark.spread == place.spread;
        });
    order_.push_back(n);
    in_tissue += landmarks.empty() ? 0 : 1;
    if (stays) continue;
    changed_[n] = update_;
    places_[n].clear();
    for (const NeedleLandmark& landmark : landmarks)
      places_[n].push_back({landmark.position, landmark.spread});
  }
  is_by_rest_ = budget.allowance({.needles = in_tissue}).puts_resting_needles_first;
  if (!is_by_rest_) return;
  std::ranges::sort(order_, [&](std::uint32_t a, std::uint32_t b) {
    return changed_[a] != changed_[b] ? changed_[a] < changed_[b] : a < b;
  });
}

}  // namespace brachy
