#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <utility>

namespace brachy {

/// A network in virtual time: values come out later, in order, or are lost. The same seed loses the same
/// values.
/// Threads: one.
template <typename T>
class DelayLine {
 public:
  /// `delay_ns` ≥ 0; `drop_share` 0 … 1.
  explicit DelayLine(std::int64_t delay_ns, double drop_share = 0, std::uint64_t seed = 1)
      : delay_ns_(delay_ns), drop_share_(drop_share), random_(seed) {}

  void push(T value, std::int64_t now_ns) {
    // No standard distribution: those differ between libraries.
    const bool lost = static_cast<double>(random_() >> 11) * 0x1p-53 < drop_share_;
    if (lost)
      ++lost_;
    else
      under_way_.emplace_back(now_ns + delay_ns_, std::move(value));
  }

  /// The newest value that has arrived by now and was not returned before; older ones are skipped.
  std::optional<T> newest(std::int64_t now_ns) {
    std::optional<T> value;
    while (!under_way_.empty() && under_way_.front().first <= now_ns) {
      value = std::move(under_way_.front().second);
      under_way_.pop_front();
    }
    return value;
  }

  std::uint64_t lost() const { return lost_; }

 private:
  std::int64_t delay_ns_;
  double drop_share_;
  std::mt19937_64 random_;
  std::deque<std::pair<std::int64_t, T>> under_way_;  // arrival, value
  std::uint64_t lost_ = 0;
};

}  // namespace brachy
