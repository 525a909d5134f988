#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>

#include "core/base/rigid_transform.h"

namespace brachy {

/// Detects oscillation in a motion that also travels: turning points of one coordinate, ignoring turns of
/// less than `least` (mm). It oscillates if it completes five swings within a second (kSwings + 1 turns) and
/// the last swing is no smaller than the first: a decaying swing does not count, nor does occasional
/// stick-slip.
/// Threads: one.
class SwingMeter {
 public:
  static constexpr std::size_t kSwings = 10;  ///< half-waves

  explicit SwingMeter(double least_mm) : least_(least_mm) {}

  void add(double x, double t_s) {
    if (!started_) {
      started_ = true;
      extreme_ = x;
    }
    const bool on = rising_ ? x > extreme_ : x < extreme_;
    if (on) {
      extreme_ = x;
    } else if (std::abs(x - extreme_) >= least_) {
      turn(t_s);
      rising_ = !rising_;
      extreme_ = x;
    }
  }

  bool rang() const { return rang_; }
  double first_s() const { return first_s_; }  ///< when it was first seen, if it rang

 private:
  struct Turn {
    double x, t_s;
  };

  void turn(double t_s) {
    turns_.push_back({extreme_, t_s});
    if (turns_.size() > kSwings + 1) turns_.pop_front();
    if (rang_ || turns_.size() <= kSwings || t_s - turns_.front().t_s > 1) return;
    const auto swing = [this](std::size_t i) { return std::abs(turns_[i + 1].x - turns_[i].x); };
    const double first = std::max(swing(0), swing(1));
    const double last = std::max(swing(kSwings - 1), swing(kSwings - 2));
    rang_ = last >= 0.98 * first;
    if (rang_) first_s_ = t_s;
  }

  double least_;
  bool started_ = false, rising_ = true, rang_ = false;
  double extreme_ = 0, first_s_ = 0;
  std::deque<Turn> turns_;
};

/// The load on a hand: the largest force, its largest change in a millisecond, and whether the device
/// oscillated.
/// Threads: one.
class HandReport {
 public:
  /// `least_swing_mm`: several encoder steps.
  explicit HandReport(double least_swing_mm = 0.1)
      : meters_{SwingMeter(least_swing_mm), SwingMeter(least_swing_mm), SwingMeter(least_swing_mm)} {}

  /// One device cycle that begins at t_s, of `period_s`: force on the needle, and the tip relative to the
  /// hand, mm.
  void add(double t_s, double period_s, const Vec3& force_n, const Vec3& tip_from_hand) {
    peak_force_n_ = std::max(peak_force_n_, force_n.norm());
    // A step of a slow loop counts as one jump, not divided by its milliseconds.
    largest_jump_n_per_ms_ =
        std::max(largest_jump_n_per_ms_, (force_n - force_n_).norm() / std::min(1e3 * period_s, 1.0));
    force_n_ = force_n;
    for (int i = 0; i < 3; ++i) meters_[static_cast<std::size_t>(i)].add(tip_from_hand[i], t_s);
  }

  double peak_force_n() const { return peak_force_n_; }
  double largest_jump_n_per_ms() const { return largest_jump_n_per_ms_; }
  bool oscillated() const {
    return std::ranges::any_of(meters_, [](const SwingMeter& meter) { return meter.rang(); });
  }
  /// When oscillation was first detected, s; NaN: never.
  double oscillated_at_s() const {
    double first = NAN;
    for (const SwingMeter& meter : meters_)
      if (meter.rang()) first = std::fmin(first, meter.first_s());
    return first;
  }

 private:
  std::array<SwingMeter, 3> meters_;
  Vec3 force_n_ = Vec3::Zero();
  double peak_force_n_ = 0, largest_jump_n_per_ms_ = 0;
};

}  // namespace brachy
