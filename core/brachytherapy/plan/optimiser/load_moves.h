#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/repeatable_random.h"
#include "core/brachytherapy/plan/optimiser/needle_choices.h"
#include "core/brachytherapy/plan/optimiser/plan_dose.h"

namespace brachy {

/// The loads that an annealer moves among, and its proposals.
class LoadMoves {
 public:
  LoadMoves(const std::vector<NeedleChoice>& choices, std::vector<NeedleLoad> loads, std::size_t most_needles,
            std::size_t most_seeds, std::size_t most_seeds_a_needle, std::uint64_t seed);

  const std::vector<NeedleLoad>& loads() const { return loads_; }
  std::size_t needles() const { return used_.size(); }
  std::size_t seeds() const { return seeds_; }
  RepeatableRandom& random() { return random_; }

  /// One or two needles changed at random; nothing where the draw is not allowed.
  const std::vector<LoadChange>* propose();
  /// Makes the last proposal.
  void keep();

 private:
  bool change_needle();
  bool insert_needle();
  bool remove_needle();
  bool move_to_hole();
  bool shift_seed_between();
  bool is_allowed();

  const std::vector<NeedleChoice>& choices_;
  std::vector<NeedleLoad> loads_;
  std::vector<std::size_t> used_;
  std::vector<std::vector<std::size_t>> near_;  // holes near each
  std::size_t seeds_ = 0, most_needles_, most_seeds_, most_seeds_a_needle_;
  RepeatableRandom random_;
  std::vector<LoadChange> proposal_;
};

}  // namespace brachy
