#include "core/brachytherapy/plan/request/source_limits.h"

#include <cmath>
#include <numbers>

#include "core/brachytherapy/dose/dose_rate.h"

namespace brachy {
namespace {

constexpr double kSameHalfLife = 0.01;
constexpr double kIodineGy = 145;

constexpr SourceLimits kNuclides[] = {
    {"I-125", 59.40, 0.25, 0.76, 0.5, kIodineGy,
     "as ordered for permanent prostate implants: 0.2 to 0.6 mCi of 1.27 U"},
    {"Pd-103", 16.991, 1.1, 3.2, 2.0, 125,
     "about 0.9 to 2.5 mCi of 1.293 U each; 226 implants had 2 U in the mean (J. Appl. Clin. Med. Phys. 19, "
     "2018)"},
    {"Cs-131", 9.689, 1.6, 2.2, 1.8, 115, "Bice et al., Brachytherapy 7 (2008), 290-296: 1.6 to 2.2 U"},
};

/// The mean dose of a seed of 1 U whose distance from the point is that of two random points of a ball, Gy.
double mean_ball_dose_gy(SourceModel model, double radius_cm) {
  constexpr int kSteps = 400;
  const Tg43Source& source = tg43_source(model);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double r = 2 * radius_cm * (i + 0.5) / kSteps, t = r / radius_cm;
    const double share = 3 * t * t * (1 - 0.75 * t + t * t * t / 16) / radius_cm;
    const double part = 10 * r / std::numbers::sqrt2;  // at 45°: along and away, mm
    sum += share * dose_rate_per_u(source, part, part);
  }
  return sum * (2 * radius_cm / kSteps) * total_gy_per_cgy_h(model);
}

}  // namespace

std::optional<SourceLimits> source_limits(SourceModel source) {
  const double half_life = tg43_source(source).half_life_days;
  for (const SourceLimits& limits : kNuclides)
    if (std::abs(half_life / limits.half_life_days - 1) < kSameHalfLife) return limits;
  return {};
}

double customary_strength_u(SourceModel source, double prescription_gy, double mean_cm) {
  const double radius = 0.5 * mean_cm;
  return 2.15 * mean_cm * mean_cm * (prescription_gy / kIodineGy) *
         mean_ball_dose_gy(SourceModel::kAmersham6711, radius) / mean_ball_dose_gy(source, radius);
}

}  // namespace brachy
