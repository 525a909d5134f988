#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "apps/forces/force_log.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/seeds/seed.h"
#include "core/brachytherapy/structures/structure.h"
#include "haptics/trajectory/trajectory.h"

namespace brachy::test {

/// D4 with two seeds, tip at z = 15; F6 with one, tip at z = 10. Planned seeds 0 and 1 at (−15, −15, 12.75) and (…,
/// 2.75), 2 at (−5, −5, 7.75), in the default grid.
inline Plan small_plan() {
  Plan plan;
  plan.name = "small";
  plan.air_kerma_strength_u = 0.6;
  plan.base_plane_mm = 75;
  plan.needles = {{"D4", 0, "s-s"}, {"F6", 5, "s"}};
  return plan;
}

inline const Plan kPlan = small_plan();
inline const TemplateGrid kGrid;

/// Fell `dropped` beside the plan's seed and lies `rest` beside it.
inline Seed seed_beside(const PlannedSeed& planned, std::uint32_t id, std::int32_t index, const Vec3& dropped,
                        const Vec3& rest) {
  Seed seed;
  seed.id = id;
  seed.tick = 200 * id;
  seed.t_s = id;
  seed.planned = index;
  seed.air_kerma_strength_u = planned.air_kerma_strength_u;
  seed.dropped = planned.position + dropped;
  seed.rest = seed.position = planned.position + rest;
  return seed;
}

/// All of small_plan's, as planned except: 0 fell 1.2 mm short and 0.5 mm aside and lies 3 mm too deep; 1 fell exactly
/// and lies 4 mm aside and 3 mm short; 2 is exact throughout. The gland had moved by 2, 4 and 6 mm.
inline std::vector<Seed> small_seeds() {
  const std::vector<PlannedSeed> planned = small_plan().seeds(TemplateGrid{});
  std::vector<Seed> seeds = {seed_beside(planned[0], 1, 0, Vec3(0.3, 0.4, -1.2), Vec3(0, 0, 3)),
                             seed_beside(planned[1], 2, 1, Vec3::Zero(), Vec3(0, 4, -3)),
                             seed_beside(planned[2], 3, 2, Vec3::Zero(), Vec3::Zero())};
  for (std::size_t i = 0; i < 3; ++i) seeds[i].gland_motion = Vec3(0, 0, 2.0 * static_cast<double>(i + 1));
  return seeds;
}

/// Closed, outward octahedron |x| + |y| + |z| = size, mm.
inline SurfaceMesh octahedron(double size) {
  return {{{size, 0, 0}, {-size, 0, 0}, {0, size, 0}, {0, -size, 0}, {0, 0, size}, {0, 0, -size}},
          {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
}

/// A pose with its tip at (x, y, z) and its shaft along +z.
inline TrajectorySample straight(double t_s, double x, double y, double z) {
  return {t_s, {Mat3::Identity(), Vec3(x, y, z)}};
}

inline ForceSample force_at(double t_s, std::uint32_t needle, ContactState state, const Vec3& force_n) {
  ForceSample sample;
  sample.t_s = t_s;
  sample.needle = needle;
  sample.state = state;
  sample.forces.force_n = force_n;
  return sample;
}

}  // namespace brachy::test
