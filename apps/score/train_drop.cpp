#include "apps/score/train_drop.h"

#include <algorithm>
#include <map>

namespace brachy {

std::vector<TrainDrop> train_drops(const SeedsScore& seeds, std::size_t plan_needles) {
  std::vector<std::vector<const Seed*>> trains(plan_needles);
  for (const SeedScore& seed : seeds.planned) trains[seed.planned.needle].push_back(&seed.seed);
  std::vector<TrainDrop> drops;
  for (std::size_t n = 0; n < trains.size(); ++n) {
    const auto& train = trains[n];
    if (train.size() < 2) continue;
    TrainDrop drop{.needle = n};
    const double whole = (train.back()->dropped - train.front()->dropped).norm();
    for (std::size_t i = 0; i < train.size(); ++i)
      for (std::size_t j = i + 1; j < train.size(); ++j) {
        const double way = (train[j]->dropped - train[i]->dropped).norm();
        if (way < std::min(TrainDrop::kLeastWayMm, whole)) continue;
        drop.at_least_mm_s =
            std::max(drop.at_least_mm_s, way / (std::abs(train[j]->t_s - train[i]->t_s) + TrainDrop::kTickS));
      }
    drops.push_back(drop);
  }
  return drops;
}

std::vector<std::size_t> unpunctured_needles(const SeedsScore& seeds, std::span<const RecordedForce> forces) {
  std::map<std::size_t, const Seed*> first;  // by the plan's needle
  for (const SeedScore& seed : seeds.planned) first.try_emplace(seed.planned.needle, &seed.seed);
  std::vector<std::size_t> needles;
  for (const auto& [needle, seed] : first) {
    // Rows are in order of time.
    auto row = std::ranges::upper_bound(forces, seed->t_s + 1e-6, {}, &RecordedForce::t_s);
    while (row != forces.begin() && std::prev(row)->needle != seed->needle) --row;
    if (row != forces.begin() && std::prev(row)->state == ContactState::kTouching) needles.push_back(needle);
  }
  return needles;
}

}  // namespace brachy
