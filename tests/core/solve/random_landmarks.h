#pragma once

#include <random>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy::test {

inline double uniform(std::mt19937_64& random, double least, double most) {
  return least + (most - least) * static_cast<double>(random() >> 11) * 0x1p-53;
}

inline Vec3 uniform_point(std::mt19937_64& random, double half_width) {
  Vec3 p;
  for (int k = 0; k < 3; ++k) p[k] = uniform(random, -half_width, half_width);
  return p;
}

struct RandomLandmarks {
  std::vector<Vec3> positions, displacements;
};

/// n landmarks in a cube of `half_width` mm, at least `spacing` apart, each displaced by up to `reach` mm an axis.
inline RandomLandmarks random_landmarks(std::mt19937_64& random, int n, double half_width, double spacing,
                                        double reach) {
  RandomLandmarks landmarks;
  while (static_cast<int>(landmarks.positions.size()) < n) {
    const Vec3 p = uniform_point(random, half_width);
    bool far = true;
    for (const Vec3& q : landmarks.positions) far = far && (p - q).norm() >= spacing;
    if (!far) continue;
    landmarks.positions.push_back(p);
    landmarks.displacements.push_back(uniform_point(random, reach));
  }
  return landmarks;
}

}  // namespace brachy::test
