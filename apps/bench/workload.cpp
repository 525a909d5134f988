#include "apps/bench/workload.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/scene/load_tissue.h"

namespace brachy::bench {

const Tissue& phantom(std::size_t points) {
  static std::map<std::size_t, Tissue> made;
  auto found = made.find(points);
  if (found == made.end()) {
    Scene scene;
    scene.tissue.points = points;
    found = made.emplace(points, load_tissue(scene).tissue).first;
  }
  return found->second;
}

LandmarkCycle::LandmarkCycle(std::size_t n, bool moving) {
  const std::size_t needle = std::min<std::size_t>(n, 4);
  for (std::size_t tick = 0; tick < kTicks; ++tick) {
    const double phase = 2 * M_PI * static_cast<double>(tick) / kTicks;
    for (std::size_t i = 0; i < n; ++i) {
      Vec3 p, d = Vec3::Zero();
      if (i < needle) {
        const std::size_t row = i / 2;
        p = {4.0 * static_cast<double>(i % 2), 4.0 * static_cast<double>(row), -20};
        d = {0.2 * std::sin(phase), 0.2 * std::cos(phase), 5};
      } else {
        const auto k = static_cast<double>(i - needle), m = static_cast<double>(n - needle);
        const double z = 1 - (2 * k + 1) / m, r = std::sqrt(1 - z * z);
        const double t = 2.399963229728653 * k;  // golden angle
        p = {12 * r * std::cos(t), 9 * r * std::sin(t), 10.5 * z};
      }
      if (moving) {
        const double own = phase + static_cast<double>(i);
        p += 0.25 * Vec3(std::cos(own), std::sin(own), std::cos(own + 1));
      }
      positions_[tick].push_back(p);
      displacements_[tick].push_back(d);
    }
  }
}

void step_needles(Simulator& simulator, std::span<NeedlePose> poses, double z, MeshState& state) {
  for (std::size_t n = 0; n < poses.size(); ++n) {
    poses[n].present = true;
    poses[n].X_WN.p = Vec3(8 * static_cast<double>(n) - 8, -4, z);
  }
  simulator.step(poses, state);
}

Reach count_reach(std::span<const Vec3> points, std::span<const Vec3> landmarks, double support_radius) {
  Reach reach;
  for (const Vec3& X : points) {
    std::uint64_t inside = 0;
    for (const Vec3& p : landmarks) inside += (X - p).squaredNorm() < support_radius * support_radius;
    reach.pairs += inside;
    reach.points += inside > 0;
  }
  return reach;
}

double largest_difference_mm(const Tissue& tissue, const BlockField& field, std::span<const Vec3> u) {
  double largest = 0;
  auto touched = field.touched().begin();
  for (std::size_t b = 0; b < tissue.blocks.size(); ++b) {
    const bool is_touched = touched != field.touched().end() && *touched == b;
    if (is_touched) ++touched;
    for (std::size_t i = 0; i < tissue.blocks[b].count; ++i) {
      Vec3 ours = Vec3::Zero();
      if (const auto& d = field.displacement(b); is_touched) ours = {d.ux[i], d.uy[i], d.uz[i]};
      largest = std::max(largest, (ours - u[tissue.blocks[b].first + i]).cwiseAbs().maxCoeff());
    }
  }
  return largest;
}

}  // namespace brachy::bench
