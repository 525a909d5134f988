#include "apps/compare/psi_model.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "apps/comparators/paper_csrbf.h"

namespace brachy {
namespace {

bool precedes(const Vec3& a, const Vec3& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

std::vector<std::uint32_t> sorted_order(const std::vector<Vec3>& points) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) { return precedes(points[a], points[b]); });
  return order;
}

}  // namespace

void PsiModel::set_up(const ComparedScene& scene) {
  positions_ = scene.landmarks;
  if (has_anchors_)
    for (const Vec3& anchor : paper_anchors(scene.body, scene.landmarks)) positions_.push_back(anchor);
  displacements_.assign(positions_.size(), Vec3::Zero());
  tissue_ = build_tissue({}, scene.points);
  // The tissue has the same points in an order of its own: both sorted, they stand in the same places.
  order_.resize(tissue_.size());
  const auto given = sorted_order(scene.points), ours = sorted_order(tissue_.rest_vertices);
  for (std::size_t i = 0; i < ours.size(); ++i) order_[ours[i]] = given[i];
  BlockField::Options options;
  options.max_landmarks = positions_.size();
  deformation_ = std::make_unique<Deformation>(tissue_, kernel_, support_radius_, options);
}

void PsiModel::tick(std::span<const Vec3> displacements) {
  std::ranges::copy(displacements, displacements_.begin());
  if (!deformation_->update(positions_, displacements_))
    throw std::runtime_error("landmarks lie too close together for this support");
}

void PsiModel::read(std::span<Vec3> u) const {
  std::ranges::fill(u, Vec3::Zero());
  for (const std::uint32_t b : deformation_->blocks().touched()) {
    const Block& block = tissue_.blocks[b];
    const auto& moved = deformation_->blocks().displacement(b);
    for (std::uint32_t i = 0; i < block.count; ++i)
      u[order_[block.first + i]] = Vec3(moved.ux[i], moved.uy[i], moved.uz[i]);
  }
}

std::vector<Vec3> PsiModel::displacements_at(std::span<const Vec3> X) const {
  std::vector<Vec3> u;
  for (const Vec3& x : X) u.push_back(deformation_->field().displacement(x));
  return u;
}

std::vector<double> PsiModel::jacobians(std::span<const Vec3> X) const {
  std::vector<double> det;
  for (const Vec3& x : X) det.push_back(deformation_->field().jacobian(x));
  return det;
}

}  // namespace brachy
