#include "apps/lab/comparators/chainmail.h"

#include <algorithm>
#include <utility>

namespace brachy {

ChainMailLattice::ChainMailLattice(const Lattice& lattice, const Limits& limits)
    : lattice_(lattice), limits_(limits), is_held_(lattice.size()), has_moved_(lattice.size()) {
  for (auto& plane : u_) plane.resize(lattice.size());
}

void ChainMailLattice::deform(std::span<const Move> moves) {
  for (auto& plane : u_) std::ranges::fill(plane, 0.0f);
  std::fill(has_moved_.begin(), has_moved_.end(), false);
  queue_.clear();
  for (const Move& move : moves) {
    has_moved_[move.node] = true;
    for (std::size_t axis = 0; axis < 3; ++axis)
      u_[axis][move.node] = static_cast<float>(move.displacement[static_cast<Eigen::Index>(axis)]);
  }
  for (const Move& move : moves) enqueue_neighbours(move.node);
  for (std::size_t next = 0; next < queue_.size(); ++next) {
    const Visit visit = queue_[next];
    if (has_moved_[visit.node] || !follow(visit.node, visit.sponsor, visit.axis, visit.sign)) continue;
    has_moved_[visit.node] = true;
    enqueue_neighbours(visit.node);
  }
}

void ChainMailLattice::enqueue_neighbours(std::size_t node) {
  const auto place = lattice_.place(node);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t stride = lattice_.stride(axis);
    if (place[axis] + 1 < lattice_.count()[axis] && !is_held_[node + stride])
      queue_.push_back({node + stride, node, axis, 1});
    if (place[axis] > 0 && !is_held_[node - stride]) queue_.push_back({node - stride, node, axis, -1});
  }
}

bool ChainMailLattice::follow(std::size_t node, std::size_t sponsor, std::size_t link, int sign) {
  const auto length = static_cast<float>(lattice_.cell()[static_cast<Eigen::Index>(link)]);
  bool moved = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Of the node's displacement less its sponsor's.
    float least = -static_cast<float>(limits_.shear) * length, most = -least;
    if (axis == link) {
      least = static_cast<float>(limits_.least - 1) * length;
      most = static_cast<float>(limits_.most - 1) * length;
      if (sign < 0) least = -std::exchange(most, -least);
    }
    const float sponsored = u_[axis][sponsor];
    float& u = u_[axis][node];
    const float clamped = std::clamp(u, sponsored + least, sponsored + most);
    moved |= clamped != u;
    u = clamped;
  }
  return moved;
}

void ChainMail::set_up(const ComparedScene& scene) {
  lattice_ = std::make_unique<Lattice>(scene.body.box_centre, scene.body.box_size, spacing_);
  mail_ = std::make_unique<ChainMailLattice>(*lattice_, ChainMailLattice::Limits{});
  for (std::size_t node = 0; node < lattice_->size(); ++node)
    if (lattice_->is_held(node, scene.body)) mail_->hold(node);
  imposed_ = impose(*lattice_, scene.landmarks);
  for (const Vec3& X : scene.points) places_.push_back(lattice_->locate(X));
  u_.assign(places_.size(), Vec3::Zero());
}

void ChainMail::tick(std::span<const Vec3> displacements) {
  moves_.clear();
  for (const ImposedNode& node : imposed_) moves_.push_back({node.node, node.displacement(displacements)});
  mail_->deform(moves_);
  for (std::size_t i = 0; i < places_.size(); ++i)
    u_[i] = lattice_->interpolate(places_[i], mail_->displacements());
}

bool ChainMail::move(std::span<const Vec3> landmarks) {
  imposed_ = impose(*lattice_, landmarks);
  return true;
}

void ChainMail::read(std::span<Vec3> u) const {
  std::ranges::copy(u_, u.begin());
}

std::vector<Vec3> ChainMail::displacements_at(std::span<const Vec3> X) const {
  std::vector<Vec3> u;
  for (const Vec3& x : X) u.push_back(lattice_->interpolate(lattice_->locate(x), mail_->displacements()));
  return u;
}

}  // namespace brachy
