#include "core/brachytherapy/dose/swelling_phases.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/brachytherapy/dose/dose_grid.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/dose/source.h"

namespace brachy {
namespace {

const Vec3 kDayZero{1.01, 1.11, 1.08};
constexpr SourceModel kSources[] = {SourceModel::kAmersham6711, SourceModel::kTheraSeed200};

DoseSeed oblique_seed(SourceModel source) {
  return {.position = {1, -2, 3},
          .axis = Vec3(0.1, 0.3, 1).normalized(),
          .source = source,
          .air_kerma_strength_u = 0.5};
}

// What the tissue at p gets, hour by hour.
double integrated_gy(const DoseSeed& seed, const Vec3& p, double resolved_days) {
  const double rate = std::numbers::ln2 / tg43_source(seed.source).half_life_days;
  const double step = 1.0 / 24;
  double gy = 0;
  const auto dose_at = [&](double day) {
    const Vec3 stretch = Vec3::Ones() + std::max(0.0, 1 - day / resolved_days) * (kDayZero - Vec3::Ones());
    DoseSeed now = seed;
    now.position = stretch.cwiseProduct(seed.position);
    now.axis = stretch.cwiseProduct(seed.axis).normalized();
    return total_dose_gy(std::array{now}, stretch.cwiseProduct(p));
  };
  for (double day = 0; day < resolved_days - step / 2; day += step)
    gy += (std::exp(-rate * day) - std::exp(-rate * (day + step))) * dose_at(day + step / 2);
  return gy + std::exp(-rate * resolved_days) * dose_at(resolved_days);
}

TEST(SwellingPhases, ShareOutTheWholeDecay) {
  for (const SourceModel source : kSources) {
    double sum = 0;
    Vec3 last = kDayZero;
    for (const SwellingPhase& phase : resolving_swelling(tg43_source(source).half_life_days, kDayZero, 30)) {
      sum += phase.share;
      EXPECT_TRUE((phase.stretch.array() < last.array()).all());
      EXPECT_TRUE((phase.stretch.array() >= 1).all());
      last = phase.stretch;
    }
    EXPECT_NEAR(sum, 1, 1e-14);
    EXPECT_EQ(last, Vec3::Ones());
  }
}

TEST(SwellingPhases, GiveTheDoseOfAGlandThatShrinksHourByHour) {
  for (const SourceModel source : kSources) {
    const DoseSeed seed = oblique_seed(source);
    DoseGrid grid(Vec3::Constant(-15), Vec3::Constant(15), 3);
    for (const SwellingPhase& phase : resolving_swelling(tg43_source(source).half_life_days, kDayZero, 30)) {
      DoseSeed of_phase = seed;
      of_phase.air_kerma_strength_u *= phase.share;
      grid.add(of_phase, phase.stretch);
    }
    double largest = 0, less = 0;
    for (std::size_t k = 0; k < 11; k += 2)
      for (std::size_t j = 0; j < 11; ++j)
        for (std::size_t i = 0; i < 11; i += 2) {
          const Vec3 p = grid.position(i, j, k);
          if ((p - seed.position).norm() < 3) continue;
          const double gy = grid.dose_gy()[grid.index(i, j, k)];
          largest = std::max(largest, std::abs(gy / integrated_gy(seed, p, 30) - 1));
          less = std::max(less, 1 - gy / total_dose_gy(std::array{seed}, p));
        }
    EXPECT_LT(largest, 1e-3);
    EXPECT_GT(less, source == SourceModel::kTheraSeed200 ? 0.08 : 0.03) << "the tissue was farther off";
  }
}

TEST(SwellingPhases, WithoutSwellingNothingChanges) {
  const DoseSeed seed = oblique_seed(SourceModel::kAmersham6711);
  DoseGrid plain(Vec3::Constant(-9), Vec3::Constant(9), 3), phases = plain;
  plain.add(seed);
  for (const SwellingPhase& phase : resolving_swelling(59.4, Vec3::Ones(), 30)) {
    DoseSeed of_phase = seed;
    of_phase.air_kerma_strength_u *= phase.share;
    phases.add(of_phase, phase.stretch);
  }
  for (std::size_t i = 0; i < plain.dose_gy().size(); ++i)
    EXPECT_NEAR(phases.dose_gy()[i] / plain.dose_gy()[i], 1, 1e-5);
}

}  // namespace
}  // namespace brachy
