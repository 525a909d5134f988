#include "core/brachytherapy/plan/optimiser/load_moves.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace brachy {
namespace {

constexpr double kNearMm = 11;  // two holes of the customary template
constexpr int kMostShiftMm = 5;

void swap_elements(NeedleLoad& load, int e) {
  const std::uint32_t both = std::uint32_t{3} << e;
  if (load.is_seed(e) != load.is_seed(e + 1)) load.seeds ^= both;
}

void insert_element(NeedleLoad& load, int e, bool seed) {
  const std::uint32_t below = (std::uint32_t{1} << e) - 1;
  load.seeds = (load.seeds & below) | (load.seeds & ~below) << 1 | (seed ? std::uint32_t{1} << e : 0);
  ++load.elements;
}

void erase_element(NeedleLoad& load, int e) {
  const std::uint32_t below = (std::uint32_t{1} << e) - 1;
  load.seeds = (load.seeds & below) | (load.seeds >> 1 & ~below);
  --load.elements;
}

}  // namespace

LoadMoves::LoadMoves(const std::vector<NeedleChoice>& choices, std::vector<NeedleLoad> loads,
                     std::size_t most_needles, std::size_t most_seeds, std::size_t most_seeds_a_needle,
                     std::uint64_t seed)
    : choices_(choices),
      loads_(std::move(loads)),
      near_(choices.size()),
      most_needles_(most_needles),
      most_seeds_(most_seeds),
      most_seeds_a_needle_(most_seeds_a_needle),
      random_(seed) {
  for (std::size_t c = 0; c < choices_.size(); ++c) {
    if (loads_[c].is_used()) used_.push_back(c);
    seeds_ += static_cast<std::size_t>(loads_[c].seed_count());
    for (std::size_t other = 0; other < choices_.size(); ++other)
      if (other != c && (choices_[other].position - choices_[c].position).norm() <= kNearMm)
        near_[c].push_back(other);
  }
}

const std::vector<LoadChange>* LoadMoves::propose() {
  proposal_.clear();
  const double kind = random_.share();
  const bool made = kind < 0.08   ? insert_needle()
                    : kind < 0.14 ? remove_needle()
                    : kind < 0.26 ? move_to_hole()
                    : kind < 0.32 ? shift_seed_between()
                                  : change_needle();
  return made && is_allowed() ? &proposal_ : nullptr;
}

bool LoadMoves::change_needle() {
  if (used_.empty()) return false;
  const std::size_t c = used_[static_cast<std::size_t>(random_.below(static_cast<int>(used_.size())))];
  NeedleLoad load = loads_[c];
  const double kind = random_.share();
  if (kind < 0.45) {
    const int by = random_.between(1, kMostShiftMm);
    load.tip_mm += random_.share() < 0.5 ? by : -by;
  } else if (kind < 0.6) {
    load.seeds ^= std::uint32_t{1} << random_.below(load.elements);
  } else if (kind < 0.75) {
    if (load.elements < 2) return false;
    swap_elements(load, random_.below(load.elements - 1));
  } else if (kind < 0.88) {
    if (load.elements + 2 > NeedleLoad::kMostElements) return false;
    const int at = random_.below(load.elements + 1);
    const bool with_spacer = random_.share() < 0.6;
    insert_element(load, at, random_.share() < 0.7);
    if (with_spacer) insert_element(load, at, false);
    if (random_.share() < 0.5) load.tip_mm += random_.between(0, 10);
  } else {
    if (load.elements < 2) return false;
    const int at = random_.below(load.elements);
    erase_element(load, at);
    if (random_.share() < 0.5 && at < load.elements) erase_element(load, at);
    if (random_.share() < 0.5) load.tip_mm -= random_.between(0, 10);
  }
  proposal_.push_back({c, loads_[c], load});
  return true;
}

bool LoadMoves::insert_needle() {
  const auto c = static_cast<std::size_t>(random_.below(static_cast<int>(choices_.size())));
  const NeedleChoice& choice = choices_[c];
  if (loads_[c].is_used()) return false;
  NeedleLoad load;
  load.tip_mm = choice.most_tip_mm - random_.between(0, 6);
  const int longest = std::min((2 * load.tip_mm - choice.first_row) / 20 + 1, NeedleLoad::kMostElements / 2);
  if (longest < 1) return false;
  const int seeds = random_.between(1, longest);
  for (int s = 0; s < seeds; ++s) {
    if (s > 0) insert_element(load, load.elements, false);
    insert_element(load, load.elements, true);
  }
  proposal_.push_back({c, loads_[c], load});
  return true;
}

bool LoadMoves::remove_needle() {
  if (used_.empty()) return false;
  const std::size_t c = used_[static_cast<std::size_t>(random_.below(static_cast<int>(used_.size())))];
  proposal_.push_back({c, loads_[c], {}});
  return true;
}

bool LoadMoves::move_to_hole() {
  if (used_.empty()) return false;
  const std::size_t from = used_[static_cast<std::size_t>(random_.below(static_cast<int>(used_.size())))];
  if (near_[from].empty()) return false;
  const std::size_t to =
      near_[from][static_cast<std::size_t>(random_.below(static_cast<int>(near_[from].size())))];
  if (loads_[to].is_used()) return false;
  NeedleLoad load = loads_[from];
  load.tip_mm = std::min(load.tip_mm + random_.between(-1, 1), choices_[to].most_tip_mm);
  proposal_.push_back({from, loads_[from], {}});
  proposal_.push_back({to, {}, load});
  return true;
}

bool LoadMoves::shift_seed_between() {
  if (used_.size() < 2) return false;
  const std::size_t from = used_[static_cast<std::size_t>(random_.below(static_cast<int>(used_.size())))];
  const std::size_t to = used_[static_cast<std::size_t>(random_.below(static_cast<int>(used_.size())))];
  if (from == to) return false;
  NeedleLoad less = loads_[from], more = loads_[to];
  const int off = random_.below(less.elements), on = random_.below(more.elements);
  if (!less.is_seed(off) || more.is_seed(on)) return false;
  less.seeds ^= std::uint32_t{1} << off;
  more.seeds ^= std::uint32_t{1} << on;
  proposal_.push_back({from, loads_[from], less});
  proposal_.push_back({to, loads_[to], more});
  return true;
}

bool LoadMoves::is_allowed() {
  std::size_t needles = used_.size(), seeds = seeds_;
  for (LoadChange& c : proposal_) {
    c.after.trim();
    if (!c.after.is_used()) c.after = {};
    if (c.after == c.before || !choices_[c.choice].holds(c.after)) return false;
    const auto after = static_cast<std::size_t>(c.after.seed_count()),
               before = static_cast<std::size_t>(c.before.seed_count());
    if (after > most_seeds_a_needle_ && after > before) return false;
    needles += static_cast<std::size_t>(c.after.is_used()) - static_cast<std::size_t>(c.before.is_used());
    seeds += after - before;
  }
  return (needles <= most_needles_ || needles <= used_.size()) && (seeds <= most_seeds_ || seeds <= seeds_);
}

void LoadMoves::keep() {
  for (const LoadChange& change : proposal_) {
    seeds_ += static_cast<std::size_t>(change.after.seed_count());
    seeds_ -= static_cast<std::size_t>(change.before.seed_count());
    if (change.before.is_used() && !change.after.is_used())
      used_.erase(std::ranges::find(used_, change.choice));
    if (!change.before.is_used() && change.after.is_used()) used_.push_back(change.choice);
    loads_[change.choice] = change.after;
  }
}

}  // namespace brachy
