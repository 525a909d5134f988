#include "core/heterogeneous/membership.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace brachy {
namespace {

// What a region takes and leaves, and dθ/d distance.
struct Blend {
  double taken, left, slope;
};

Blend blend_at(double distance, double blend_mm) {
  const double t = 0.5 - distance / blend_mm;
  if (!(t > 0)) return {0, 1, 0};
  if (t >= 1) return {1, 0, 0};
  const double S = std::min(1.0, t * t * t * (10 + t * (-15 + 6 * t)));
  const double angle = 0.5 * std::numbers::pi * S, slope = 15 * std::numbers::pi * t * t * (1 - t) * (1 - t);
  return {std::sin(angle), std::cos(angle), -slope / blend_mm};
}

}  // namespace

Membership::Membership(std::vector<Part> parts, std::size_t tissues)
    : parts_(std::move(parts)), tissues_(tissues) {
  assert(tissues > 0 && tissues <= kMaxTissues);
  for ([[maybe_unused]] const Part& part : parts_)
    assert(part.region && part.blend_mm > 0 && part.tissue < tissues);
}

void Membership::shares(const Vec3& X, std::span<double> w) const noexcept {
  assert(w.size() == tissues_);
  std::ranges::fill(w, 0.0);
  double left = 1;
  for (std::size_t p = parts_.size(); p > 0 && left > 0; --p) {
    const Part& part = parts_[p - 1];
    const Blend blend = blend_at(part.region->signed_distance(X), part.blend_mm);
    const double share = left * blend.taken;
    w[part.tissue] += share * share;
    left *= blend.left;
  }
  w[0] += left * left;
  for (double& v : w) v = std::sqrt(v);
}

void Membership::shares(const Vec3& X, std::span<double> w, std::span<Vec3> gradients) const noexcept {
  assert(w.size() == tissues_ && gradients.size() == tissues_);
  std::ranges::fill(w, 0.0);
  std::ranges::fill(gradients, Vec3::Zero());
  double left = 1;
  Vec3 left_gradient = Vec3::Zero();
  // Until the end w and gradients hold Σ share² and half its gradient.
  const auto add = [&](std::size_t tissue, double share, const Vec3& gradient) {
    w[tissue] += share * share;
    gradients[tissue] += share * gradient;
  };
  for (std::size_t p = parts_.size(); p > 0 && left > 0; --p) {
    const Part& part = parts_[p - 1];
    Vec3 normal;
    const Blend blend = blend_at(part.region->signed_distance(X, &normal), part.blend_mm);
    const Vec3 turn = left * blend.slope * normal;
    add(part.tissue, left * blend.taken, blend.taken * left_gradient + blend.left * turn);
    left_gradient = blend.left * left_gradient - blend.taken * turn;
    left *= blend.left;
  }
  add(0, left, left_gradient);
  for (std::size_t m = 0; m < tissues_; ++m) {
    w[m] = std::sqrt(w[m]);
    gradients[m] = w[m] > 0 ? Vec3(gradients[m] / w[m]) : Vec3(Vec3::Zero());
  }
}

}  // namespace brachy
