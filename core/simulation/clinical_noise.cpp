#include "core/simulation/clinical_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/repeatable_random.h"

namespace brachy {
namespace {

// What a number is drawn for.
enum : std::uint64_t { kPlay = 1, kStop, kTremor, kDrop, kMigration, kDrift };
constexpr std::array kTremorHz = {8.3, 9.7, 11.6};  // of physiological tremor, 8 to 12 Hz; no common period

// In (0, 1).
double uniform_of(std::uint64_t bits) {
  return (static_cast<double>(bits >> 11) + 0.5) * 0x1p-53;
}

}  // namespace

ClinicalNoise::ClinicalNoise(const NoiseSettings& settings, std::size_t needles)
    : settings_(settings), hands_(needles) {}

// G. Box, M. Muller, Ann. Math. Stat. 29 (1958) 610.
double ClinicalNoise::normal(std::uint64_t what, std::uint64_t which,
                             std::uint64_t component) const noexcept {
  const std::uint64_t bits = mixed(mixed(mixed(settings_.seed ^ what << 56) ^ which) ^ component << 32);
  return std::sqrt(-2 * std::log(uniform_of(bits))) *
         std::cos(2 * std::numbers::pi * uniform_of(mixed(bits)));
}

RigidTransform ClinicalNoise::held(std::size_t needle, const RigidTransform& X_WN, double t_s,
                                   double period_s, bool is_in_tissue) noexcept {
  if (!settings_.on) return X_WN;
  Hand& hand = hands_[needle];
  if (hand.was_in_tissue && !is_in_tissue) {
    ++hand.insertion;
    hand.fastest_mm_s = 0;
  }
  hand.was_in_tissue = is_in_tissue;
  const Vec3 x = X_WN.R.col(0), y = X_WN.R.col(1), z = X_WN.R.col(2);
  if (hand.is_known && is_in_tissue)
    hand.fastest_mm_s = std::max(hand.fastest_mm_s, (X_WN.p - hand.last_tip).dot(z) / period_s);
  hand.is_known = true;
  hand.last_tip = X_WN.p;

  const std::uint64_t which = static_cast<std::uint64_t>(needle) << 32 | hand.insertion;
  RigidTransform held = X_WN;
  held.p += settings_.template_play_mm * (normal(kPlay, which, 0) * x + normal(kPlay, which, 1) * y) +
            settings_.stop_s * hand.fastest_mm_s * normal(kStop, which, 0) * z;
  if (settings_.drift_mm > 0) held.p += settings_.drift_mm * normal(kDrift, 0, 0) * z;
  // Sinusoids of equal power: their sum has the standard deviation that is asked for.
  const double amplitude = settings_.tremor_mm * std::sqrt(2.0 / kTremorHz.size());
  for (std::uint64_t k = 0; k < kTremorHz.size(); ++k)
    for (std::uint64_t axis = 0; axis < 3; ++axis) {
      const double phase = normal(kTremor, needle, 3 * k + axis) * 2 * std::numbers::pi;
      held.p[static_cast<Eigen::Index>(axis)] +=
          amplitude * std::sin(2 * std::numbers::pi * kTremorHz[k] * t_s + phase);
    }
  return held;
}

// Seeds follow the needle that is drawn back, never the other way.
Vec3 ClinicalNoise::drop_offset(std::uint32_t id, const Vec3& axis) const noexcept {
  if (!settings_.on) return Vec3::Zero();
  const Vec3 across = axis.unitOrthogonal();
  return (settings_.drop_along_mm * normal(kDrop, id, 0) -
          settings_.migration_along_mm * std::abs(normal(kMigration, id, 0))) *
             axis +
         settings_.drop_across_mm *
             (normal(kDrop, id, 1) * across + normal(kDrop, id, 2) * axis.cross(across));
}

}  // namespace brachy
