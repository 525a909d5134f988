#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace brachy {

/// Remembers landmarks by what they are made of, not by their number: a slot keeps what is known of one, and a landmark
/// that was there before finds its slot again whichever number it has now, however many ticks later, until the slot is
/// needed for another. So when one needle gets a landmark more, those of all others keep theirs. Of few landmarks few
/// slots are used, the first: what is kept of them and of their pairs stays in the processor's caches. Pairs of
/// landmarks are remembered by their slots, and in the order in which they were computed.
/// `Part`: equality comparable, with `double key() const`; equal parts have equal keys.
/// Threads: one. Real-time: no allocation after construction, with at most `max_parts` parts a landmark.
template <class Part>
class LandmarkSlots {
 public:
  LandmarkSlots(std::size_t max_landmarks, std::size_t max_parts)
      : parts_(max_landmarks),
        kept_(max_landmarks),
        keys_(max_landmarks, 0),
        generations_(max_landmarks, 0),
        claimed_(max_landmarks, 0),
        pairs_(max_landmarks * max_landmarks, 0) {
    for (auto* all : {&parts_, &kept_})
      for (std::vector<Part>& parts : *all) parts.reserve(max_parts);
    slots_.reserve(max_landmarks);
    is_fresh_.reserve(max_landmarks);
  }

  /// Starts with `landmarks` landmarks of no parts, which `add` adds in a fixed order …
  void begin(std::size_t landmarks) noexcept {
    slots_.assign(landmarks, kNone);
    is_fresh_.assign(landmarks, 0);
    for (std::size_t l = 0; l < landmarks; ++l) parts_[l].clear();
  }
  void add(std::size_t landmark, const Part& part) noexcept { parts_[landmark].push_back(part); }
  /// … and finds their slots.
  void find() noexcept {
    ++round_;
    for (std::size_t l = 0; l < slots_.size(); ++l) recall(l);
    for (std::size_t l = 0; l < slots_.size(); ++l)
      if (slots_[l] == kNone) replace(l);
  }

  std::size_t slot(std::size_t landmark) const { return slots_[landmark]; }
  /// Whether nothing is known of it yet.
  bool is_fresh(std::size_t landmark) const { return is_fresh_[landmark] != 0; }
  /// Whether nothing is known of the pair, in this order; from now on it is.
  bool take_pair(std::size_t a, std::size_t b) noexcept {
    const std::size_t i = slots_[a], j = slots_[b];
    const std::uint64_t both = std::uint64_t{generations_[i]} << 32 | generations_[j];
    std::uint64_t& known = pairs_[i * kept_.size() + j];
    if (known == both) return false;
    known = both;
    return true;
  }

 private:
  static constexpr std::uint32_t kNone = ~0u;
  static constexpr std::size_t kMore = 32;

  static double key_of(const std::vector<Part>& parts) {
    double key = static_cast<double>(parts.size());
    for (const Part& part : parts) key += part.key();
    return key;
  }

  void recall(std::size_t l) noexcept {
    const double key = key_of(parts_[l]);
    const auto end = keys_.begin() + static_cast<std::ptrdiff_t>(used_);
    for (auto at = keys_.begin(); (at = std::find(at, end, key)) != end; ++at) {
      const auto slot = static_cast<std::size_t>(at - keys_.begin());
      if (generations_[slot] == 0 || claimed_[slot] == round_ || kept_[slot] != parts_[l]) continue;
      claim(l, slot);
      return;
    }
  }
  // Some slots more than there are landmarks take turns: one that was filled long ago is likely not to be asked for
  // again.
  void replace(std::size_t l) noexcept {
    const std::size_t taking_turns = std::min(kept_.size(), kMore + 2 * slots_.size());
    next_ %= taking_turns;
    while (claimed_[next_] == round_) next_ = (next_ + 1) % taking_turns;
    used_ = std::max(used_, next_ + 1);
    claim(l, next_);
    kept_[next_] = parts_[l];
    keys_[next_] = key_of(parts_[l]);
    generations_[next_] = ++generation_;
    is_fresh_[l] = 1;
  }
  void claim(std::size_t l, std::size_t slot) noexcept {
    slots_[l] = static_cast<std::uint32_t>(slot);
    claimed_[slot] = round_;
  }

  std::vector<std::vector<Part>> parts_;  // of each landmark
  std::vector<std::uint32_t> slots_;      // of each landmark …
  std::vector<std::uint8_t> is_fresh_;
  std::vector<std::vector<Part>> kept_;  // … and by slot
  std::vector<double> keys_;
  std::vector<std::uint32_t> generations_;  // counts what was put in; 0: nothing yet
  std::vector<std::uint64_t> claimed_;      // the last round in which a landmark had it
  std::vector<std::uint64_t> pairs_;        // both generations when it was computed
  std::uint64_t round_ = 0;
  std::uint32_t generation_ = 0;
  std::size_t next_ = 0;  // whose turn is next
  std::size_t used_ = 0;  // slots that were ever filled
};

}  // namespace brachy
