#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>

#include "core/base/rigid_transform.h"
#include "core/needle/local_contact_model.h"

namespace brachy::test {

/// Doubles of every class from a source of 64-bit numbers: zeros, subnormals, ordinary ones, huge ones, infinities,
/// NaNs, and any bits. Shared by the tests of what acts on a hand and by the fuzz target.
template <class Bits>
class AnyNumber {
 public:
  /// `bits()` gives the next 64 bits.
  explicit AnyNumber(Bits bits) : bits_(std::move(bits)) {}

  std::uint64_t below(std::uint64_t n) { return bits_() % n; }
  double unit() { return static_cast<double>(bits_() >> 11) * 0x1p-53; }
  /// Within ±size.
  double within(double size) { return size * (2 * unit() - 1); }

  double any() {
    using Limits = std::numeric_limits<double>;
    const double sign = below(2) == 0 ? 1 : -1;
    switch (below(12)) {
      case 0:
        return sign * 0.0;
      case 1:
        return sign * Limits::denorm_min();
      case 2:
        return sign * Limits::min();
      case 3:
        return sign * Limits::max();
      case 4:
        return sign * Limits::infinity();
      case 5:
        return Limits::quiet_NaN();
      case 6:
        return sign * std::ldexp(1 + unit(), static_cast<int>(below(2000)) - 1000);
      case 7:
        return std::bit_cast<double>(bits_());
      case 8:
        return within(1e6);
      default:
        return within(10);
    }
  }
  Vec3 any_vector() { return {any(), any(), any()}; }
  /// Mostly a place near the tissue, else anything.
  Vec3 place() { return below(4) == 0 ? any_vector() : Vec3(within(20), within(20), within(20)); }

  std::int64_t any_time() {
    switch (below(6)) {
      case 0:
        return INT64_MIN;
      case 1:
        return INT64_MAX;
      case 2:
        return 0;
      default:
        return std::bit_cast<std::int64_t>(bits_());
    }
  }

  /// A model that is mostly usable except for one or two numbers.
  LocalContactModel model() {
    LocalContactModel m;
    m.in_contact = below(3) != 0;
    m.is_capsule = below(2) == 0;
    m.is_stuck = below(2) == 0;
    m.axis = Vec3(within(1), within(1), 1 + unit()).normalized();
    m.reference_tip = Vec3(within(20), within(20), within(20));
    m.contact_point = Vec3(within(20), within(20), within(20));
    m.axial_stiffness_n_per_mm = 50 * unit();
    m.lateral_stiffness_n_per_mm = 50 * unit();
    m.axial_min_n = -20 * unit();
    m.axial_max_n = 20 * unit();
    m.after_puncture_n = 20 * unit();
    m.lateral_n = Vec3(within(20), within(20), within(20));
    for (std::uint64_t i = below(3); i > 0; --i) spoil(m);
    return m;
  }

 private:
  void spoil(LocalContactModel& m) {
    switch (below(11)) {
      case 0:
        m.axis = any_vector();
        break;
      case 1:
        m.reference_tip = any_vector();
        break;
      case 2:
        m.contact_point = any_vector();
        break;
      case 3:
        m.axial_stiffness_n_per_mm = any();
        break;
      case 4:
        m.lateral_stiffness_n_per_mm = any();
        break;
      case 5:
        m.axial_min_n = any();
        break;
      case 6:
        m.axial_max_n = any();
        break;
      case 7:
        m.after_puncture_n = any();
        break;
      case 8:
        m.lateral_n = any_vector();
        break;
      case 9:
        m.time_to_live_s = any();
        break;
      default:
        m.lateral_n[static_cast<int>(below(3))] = any();
    }
  }

  Bits bits_;
};

/// Mostly a cycle of up to 2 ms, sometimes any time.
template <class Number>
std::int64_t next_time(Number& number, std::int64_t now_ns) {
  if (number.below(100) == 0) return number.any_time();
  return now_ns > INT64_MAX - 4'000'000 ? now_ns
                                        : now_ns + static_cast<std::int64_t>(number.below(2'000'000));
}

inline auto numbers(std::uint64_t seed) {
  return AnyNumber([random = std::mt19937_64(seed)]() mutable { return random(); });
}

}  // namespace brachy::test
