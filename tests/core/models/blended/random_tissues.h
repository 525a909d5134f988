#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "core/models/blended/tissue_kernels.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy::test {

inline std::shared_ptr<const RegionDistance> sphere(const Vec3& centre, double radius) {
  return std::make_shared<EllipsoidDistance>(centre, Vec3::Constant(radius));
}

/// Two to five tissues of different supports and landmarks in them; and for the paper's rule K_ij = ψ(|p_i − p_j|/a_j)
/// a support for each landmark, that of the tissue with its largest share.
struct RandomTissues {
  TissueModel<ScalarKernels> model;
  std::vector<Vec3> positions, displacements;  ///< n, mm
  std::vector<double> supports;                ///< n, mm
};

/// Spheres and ellipsoids that overlap in any way in a cube of ±20 mm; supports of 4 to 10 mm and up to ten times that;
/// 2 to `most` landmarks at least 1.5 mm apart, in every other set on shafts, displaced by up to 5 mm along each axis.
inline RandomTissues random_tissues(std::mt19937_64& random, const Kernel& psi, std::size_t most = 200) {
  const double least_support = uniform(random, 4, 10);
  std::vector<double> supports = {least_support};
  std::vector<Membership::Part> parts;
  for (std::size_t regions = 1 + random() % 4; parts.size() < regions;) {
    const bool is_sphere = random() % 2 == 0;
    const double radius = uniform(random, 5, 18);
    Vec3 axes = Vec3::Constant(radius);
    if (!is_sphere) axes += Vec3::Constant(3) + uniform_point(random, 3);
    supports.push_back(least_support * uniform(random, 1, 10));
    parts.push_back({std::make_shared<EllipsoidDistance>(uniform_point(random, 20), axes),
                     uniform(random, 1, 8), supports.size() - 1});
  }
  std::swap(supports[0], supports[random() % supports.size()]);

  RandomTissues set{{{std::move(parts), supports.size()}, {psi, supports}}, {}, {}, {}};
  const std::size_t n = 2 + random() % (most - 1);
  const bool on_shafts = random() % 2 == 0;
  Vec3 next = Vec3::Zero(), step = Vec3::Zero();
  while (set.positions.size() < n) {
    next += step;
    if (!on_shafts || next.cwiseAbs().maxCoeff() > 20 || step == Vec3::Zero()) {
      next = uniform_point(random, 20);
      step = uniform_point(random, 1).normalized();
      step *= uniform(random, 1.6, 5);
    }
    bool is_far = true;
    for (const Vec3& p : set.positions) is_far = is_far && (p - next).norm() >= 1.5;
    if (!is_far) continue;
    set.positions.push_back(next);
    set.displacements.push_back(uniform_point(random, 5));
    std::array<double, Membership::kMaxTissues> w{};
    set.model.membership.shares(next, std::span(w).first(supports.size()));
    set.supports.push_back(
        supports[static_cast<std::size_t>(std::max_element(w.begin(), w.end()) - w.begin())]);
  }
  return set;
}

}  // namespace brachy::test
