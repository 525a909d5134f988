#include "core/brachytherapy/robust/implant_draw.h"

#include <algorithm>
#include <cmath>

#include "core/base/repeatable_random.h"

namespace brachy {
namespace {

/// Normal numbers for lengths: none beyond three standard deviations.
class LengthErrors {
 public:
  explicit LengthErrors(RepeatableRandom& random) : random_(random) {}

  double operator()(double sd) {
    double z = random_.normal();
    while (std::abs(z) > 3) z = random_.normal();
    return sd * z;
  }
  /// In a random direction across `axis`, `sd` long.
  Vec3 across(const Vec3& axis, double sd) {
    const Vec3 side = axis.unitOrthogonal();
    const double u = (*this)(sd / std::sqrt(2.0)), v = (*this)(sd / std::sqrt(2.0));
    return u * side + v * axis.cross(side);
  }

 private:
  RepeatableRandom& random_;
};

/// What all sources of a needle share.
struct NeedleError {
  double along_mm = 0;
  Vec3 across_mm = Vec3::Zero();
};

}  // namespace

PlannedSources PlannedSources::of(const Plan& plan, const TemplateGrid& grid) {
  PlannedSources all{{}, plan.prescription_gy};
  for (const PlannedSeed& seed : plan.seeds(grid)) all.sources.push_back({seed, seed.needle, 0});
  return all;
}

PlannedSources PlannedSources::of(const HdrPlan& plan, const TemplateGrid& grid) {
  PlannedSources all{{}, plan.prescription_gy};
  for (const Dwell& dwell : plan.dwells(grid))
    if (dwell.seconds > 0)
      all.sources.push_back(
          {as_seed(dwell, plan.source, plan.source_strength_u), dwell.catheter, dwell.seconds});
  return all;
}

ImplantDraw draw_implant(const PlannedSources& plan, const Vec3& middle, const UncertaintySettings& settings,
                         const SeedMisplacement& misplacement, std::uint64_t random_seed,
                         std::uint64_t number) {
  RepeatableRandom random(mixed(mixed(random_seed) ^ number));
  LengthErrors error(random);
  ImplantDraw draw;
  draw.gland_outline_mm = error(settings.gland_outline_mm);
  draw.urethra_outline_mm = error(settings.urethra_outline_mm);
  draw.organ_outline_mm = error(settings.organ_outline_mm);
  for (int k = 0; k < 3; ++k) draw.organs_moved_mm[k] = -error(settings.gland_movement_mm[k]);
  draw.stretch = std::cbrt(1 + error(settings.swelling_percent) / 100);
  const double drift_mm = error(settings.drift_mm);
  const double strength = std::max(
      0.0, 1 + (settings.strength_percent * random.normal() + settings.calculation_percent * random.normal() +
                settings.medium_percent * random.normal()) /
                   100);
  std::vector<NeedleError> needles;
  for (const PlannedSources::Source& source : plan.sources) {
    const Vec3& axis = source.seed.axis;
    while (needles.size() <= source.needle) {
      NeedleError needle;
      if (source.seconds > 0) {
        needle.along_mm = error(settings.source_along_mm) + error(settings.reconstruction_along_mm) +
                          error(settings.movement_along_mm);
        needle.across_mm = error.across(axis, settings.reconstruction_across_mm) +
                           error.across(axis, settings.movement_across_mm);
      } else {
        needle.across_mm = error.across(axis, std::sqrt(2.0) * misplacement.play_mm);
      }
      needles.push_back(needle);
    }
    const NeedleError& needle = needles[source.needle];
    DoseSeed seed = source.seed;
    seed.air_kerma_strength_u *= strength;
    Vec3 moved_by_gland = (draw.stretch - 1) * (seed.position - middle);
    if (source.seconds > 0) {
      // A catheter is taken along sideways, not drawn out.
      moved_by_gland -= axis.dot(moved_by_gland) * axis;
      seed.position += (needle.along_mm + drift_mm) * axis + needle.across_mm;
      seed.air_kerma_strength_u *= std::max(0.0, 1 + settings.dwell_s * random.normal() / source.seconds);
    } else {
      seed.position += needle.across_mm + error.across(axis, std::sqrt(2.0) * misplacement.across_mm) +
                       (error(misplacement.along_mm) - std::abs(error(misplacement.migration_mm))) * axis;
    }
    seed.position += moved_by_gland;
    draw.seeds.push_back(seed);
  }
  return draw;
}

}  // namespace brachy
