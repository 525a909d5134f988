#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy::test {

/// Landmarks at rest and their displacements, mm, the needle's tip last.
struct RandomScene {
  std::vector<Vec3> positions, displacements;
  double support = 12;  ///< a, mm
};

/// Scenes that occur in a simulator and in which fields fold: a shaft pushed and bent, a cluster, a shaft and an
/// anchor, landmarks at the edge of each other's support. Displacements up to 20 mm, small ones as often as large
/// ones. Deterministic on every platform: the engine's own bits only.
class RandomScenes {
 public:
  explicit RandomScenes(std::uint64_t seed) : random_(seed) {}

  RandomScene next(double min_support, double max_support, std::size_t max_landmarks = 30) {
    RandomScene scene;
    scene.support = between(min_support, max_support);
    const double a = scene.support, amplitude = 0.05 * std::pow(400.0, uniform());  // 0.05 … 20 mm
    const auto n = 1 + static_cast<std::size_t>(uniform() * static_cast<double>(max_landmarks));
    switch (random_() % 4) {
      case 0:
        shaft(scene, n, amplitude);
        break;
      case 1:
        cluster(scene, std::min<std::size_t>(n, 15), amplitude);
        break;
      case 2:
        shaft(scene, std::min(n, max_landmarks - 3), amplitude);
        add_anchors(scene);
        break;
      default:
        for (std::size_t i = 0; i < std::min<std::size_t>(n, 8); ++i) {
          scene.positions.push_back(
              i == 0 ? Vec3::Zero().eval()
                     : (scene.positions.back() + between(0.97, 1.03) * a * direction()).eval());
          scene.displacements.push_back(uniform() * amplitude * direction());
        }
    }
    return scene;
  }

  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * uniform(); }
  Vec3 direction() {
    const double z = between(-1, 1), angle = between(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }

 private:
  // Along a line, slightly bent; every landmark moves with the needle plus a bend.
  void shaft(RandomScene& scene, std::size_t n, double amplitude) {
    const double spacing = between(1, 6);
    const Vec3 axis = direction(), side = axis.unitOrthogonal(), way = direction();
    const Vec3 start = between(0, 30) * direction();
    const double bend = between(0, 0.01), phase = between(0, 6);
    for (std::size_t i = 0; i < n; ++i) {
      const double s = spacing * static_cast<double>(i);
      scene.positions.push_back(start + s * axis + bend * s * s * side);
      scene.displacements.push_back(amplitude * (0.7 * way + 0.3 * std::sin(phase + 0.1 * s) * side));
    }
  }

  void cluster(RandomScene& scene, std::size_t n, double amplitude) {
    const double radius = between(0.2, 1.5) * scene.support;
    while (scene.positions.size() < n) {
      const Vec3 p = radius * std::cbrt(uniform()) * direction();
      const bool is_near =
          std::ranges::any_of(scene.positions, [&](const Vec3& q) { return (p - q).norm() < 0.3; });
      if (is_near && uniform() < 0.9) continue;
      scene.positions.push_back(p);
      scene.displacements.push_back(uniform() * amplitude * direction());
    }
  }

  // Beside the shaft, as near as 0.25 mm.
  void add_anchors(RandomScene& scene) {
    for (int i = 0; i < 3; ++i) {
      const Vec3& beside = scene.positions[random_() % scene.positions.size()];
      scene.positions.insert(scene.positions.begin(),
                             beside + 0.25 * std::pow(40.0, uniform()) * direction());
      scene.displacements.insert(scene.displacements.begin(), Vec3::Zero());
    }
  }

  std::mt19937_64 random_;
};

}  // namespace brachy::test
