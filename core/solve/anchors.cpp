#include "core/solve/anchors.h"

#include <algorithm>
#include <cassert>
#include <random>

namespace brachy {

Anchors::Anchors(std::span<const Vec3> surface_vertices, const Options& options)
    : options_(options), lambda_(options.lambda_rest) {
  assert(options.count <= surface_vertices.size());
  for (const Vec3& v : surface_vertices) centroid_ += v;
  if (!surface_vertices.empty()) centroid_ /= static_cast<double>(surface_vertices.size());

  // Partial Fisher–Yates with the engine's own bits: the standard's distributions differ between libraries.
  std::vector<std::uint32_t> order(surface_vertices.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::mt19937_64 random(options.seed);
  for (std::size_t i = 0; i < options.count; ++i) {
    std::swap(order[i], order[i + random() % (order.size() - i)]);
    surface_points_.push_back(surface_vertices[order[i]]);
  }
  positions_.resize(surface_points_.size());
  place();
}

void Anchors::update(double load, double period_s) noexcept {
  const double range = options_.lambda_rest - options_.lambda_loaded;
  if (range <= 0) return;
  const double target = options_.lambda_rest - range * std::clamp(load, 0.0, 1.0);
  const double step = range * period_s / options_.relaxation_s;
  // std::clamp returns the target itself once it is within a step, so the return ends exactly at λ_rest.
  lambda_ = std::clamp(target, lambda_ - step, lambda_ + step);
  place();
}

void Anchors::place() noexcept {
  for (std::size_t i = 0; i < positions_.size(); ++i)
    positions_[i] = centroid_ + lambda_ * (surface_points_[i] - centroid_);
}

}  // namespace brachy
