#include "apps/lab/comparators/mass_spring.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace brachy {
namespace {

/// A spring from a node to the one at +first + sign · second; an edge where both axes are the same.
struct Direction {
  std::size_t first, second;
  int sign;
  bool is_edge() const { return first == second; }
};
constexpr std::array<Direction, 9> kSprings = {
    {{0, 0, 1}, {1, 1, 1}, {2, 2, 1}, {0, 1, 1}, {0, 1, -1}, {0, 2, 1}, {0, 2, -1}, {1, 2, 1}, {1, 2, -1}}};

/// Node indices from a spring's first node to its second, and from a cell's least node to the first: for sign −1 the
/// spring starts at the far end of its second axis.
struct Offsets {
  std::ptrdiff_t to_second, start;
};
Offsets offsets(const Lattice& lattice, const Direction& d) {
  const auto stride = [&](std::size_t axis) { return static_cast<std::ptrdiff_t>(lattice.stride(axis)); };
  if (d.is_edge()) return {stride(d.first), 0};
  return {stride(d.first) + d.sign * stride(d.second), d.sign < 0 ? stride(d.second) : 0};
}

}  // namespace

SpringLattice::SpringLattice(const Lattice& lattice, const std::function<double(const Vec3&)>& shear_modulus)
    : lattice_(lattice), mass_(lattice.size()), tension_(lattice.size()) {
  for (auto& plane : stiffness_) plane.resize(lattice.size());
  for (auto* planes : {&u_, &velocity_, &force_})
    for (auto& plane : *planes) plane.resize(lattice.size());
  add_cells(shear_modulus);
  find_limits();
}

void SpringLattice::add_cells(const std::function<double(const Vec3&)>& shear_modulus) {
  const double h = lattice_.cell().mean(), node_mass = kDensity * lattice_.cell().prod() / 8;
  double softest = std::numeric_limits<double>::max();
  for (std::size_t node = 0; node < lattice_.size(); ++node) {
    const auto p = lattice_.place(node);
    bool is_cell = true;
    for (std::size_t axis = 0; axis < 3; ++axis) is_cell &= p[axis] + 1 < lattice_.count()[axis];
    if (!is_cell) continue;
    const double modulus = shear_modulus(lattice_.position(node) + 0.5 * lattice_.cell());
    softest = std::min(softest, modulus);
    for (std::size_t corner = 0; corner < 8; ++corner)
      mass_[lattice_.node({p[0] + corner % 2, p[1] + corner / 2 % 2, p[2] + corner / 4})] +=
          static_cast<float>(node_mass);
    for (std::size_t s = 0; s < kSprings.size(); ++s) {
      const Direction& d = kSprings[s];
      const auto first =
          static_cast<std::size_t>(static_cast<std::ptrdiff_t>(node) + offsets(lattice_, d).start);
      // The cell's parallel springs of this direction: four edges, or two diagonals.
      for (std::size_t other = 0; other < 3; ++other) {
        if (d.is_edge() || other == d.first || other == d.second) continue;
        for (const std::size_t at : {first, first + lattice_.stride(other)})
          stiffness_[s][at] += static_cast<float>(modulus * h / 2);
      }
      if (!d.is_edge()) continue;
      const std::size_t a = lattice_.stride((d.first + 1) % 3), b = lattice_.stride((d.first + 2) % 3);
      for (const std::size_t at : {first, first + a, first + b, first + a + b})
        stiffness_[s][at] += static_cast<float>(modulus * h / 4);
    }
  }
  // Critical for the slowest wave of the box, so that it rests as soon as it can.
  const Vec3 size = lattice_.cell().cwiseProduct(Vec3(static_cast<double>(lattice_.count()[0] - 1),
                                                      static_cast<double>(lattice_.count()[1] - 1),
                                                      static_cast<double>(lattice_.count()[2] - 1)));
  damping_ = 2 * std::sqrt(softest / kDensity) * std::numbers::pi * size.cwiseInverse().norm();
}

void SpringLattice::find_limits() {
  constexpr double kBelowLimit = 0.9;
  // Gershgorin: no eigenvalue of M⁻¹K above twice a row's sum of |diagonal|.
  std::array<std::vector<double>, 3> row;
  for (auto& plane : row) plane.resize(lattice_.size());
  for (std::size_t s = 0; s < kSprings.size(); ++s) {
    const auto [to_second, start] = offsets(lattice_, kSprings[s]);
    for (std::size_t i = 0; i < lattice_.size(); ++i) {
      if (stiffness_[s][i] == 0) continue;
      const auto j = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(i) + to_second);
      // |n_a| Σ_b |n_b|: 1 along an edge, ½ + ½ on each axis of a diagonal.
      for (const std::size_t axis : {kSprings[s].first, kSprings[s].second})
        for (const std::size_t node : {i, j})
          row[axis][node] += stiffness_[s][i] / (kSprings[s].is_edge() ? 2.0 : 1.0);
    }
  }
  double most = 0;
  for (const auto& plane : row)
    for (std::size_t i = 0; i < plane.size(); ++i) most = std::max(most, 2 * plane[i] / mass_[i]);
  largest_step_ = kBelowLimit * 2 / std::sqrt(most);
  for (const float m : mass_) inverse_mass_.push_back(1 / m);
}

void SpringLattice::prescribe(std::size_t node, const Vec3& displacement) {
  inverse_mass_[node] = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    u_[axis][node] = static_cast<float>(displacement[static_cast<Eigen::Index>(axis)]);
    velocity_[axis][node] = 0;
  }
}

void SpringLattice::compute_forces() {
  for (auto& plane : force_) std::ranges::fill(plane, 0.0f);
  float* t = tension_.data();
  for (std::size_t s = 0; s < kSprings.size(); ++s) {
    const Direction& d = kSprings[s];
    const std::ptrdiff_t o = offsets(lattice_, d).to_second;
    const auto begin = std::max<std::ptrdiff_t>(0, -o);
    const auto end = static_cast<std::ptrdiff_t>(lattice_.size()) - std::max<std::ptrdiff_t>(0, o);
    const float* k = stiffness_[s].data();
    const float *ua = u_[d.first].data(), *ub = u_[d.second].data();
    float *fa = force_[d.first].data(), *fb = force_[d.second].data();
    if (d.is_edge()) {
      for (std::ptrdiff_t i = begin; i < end; ++i) t[i] = k[i] * (ua[i + o] - ua[i]);
      for (std::ptrdiff_t i = begin; i < end; ++i) fa[i] += t[i];
      for (std::ptrdiff_t i = begin; i < end; ++i) fa[i + o] -= t[i];
      continue;
    }
    const auto sign = static_cast<float>(d.sign);
    for (std::ptrdiff_t i = begin; i < end; ++i)
      t[i] = 0.5f * k[i] * (ua[i + o] - ua[i] + sign * (ub[i + o] - ub[i]));
    for (std::ptrdiff_t i = begin; i < end; ++i) fa[i] += t[i];
    for (std::ptrdiff_t i = begin; i < end; ++i) fa[i + o] -= t[i];
    for (std::ptrdiff_t i = begin; i < end; ++i) fb[i] += sign * t[i];
    for (std::ptrdiff_t i = begin; i < end; ++i) fb[i + o] -= sign * t[i];
  }
}

void SpringLattice::advance(double period) {
  const int steps = static_cast<int>(std::ceil(period / largest_step_));
  for (int k = 0; k < steps; ++k) step(period / steps);
}

void SpringLattice::step(double dt) {
  const auto t = static_cast<float>(dt), kept = static_cast<float>(1 / (1 + damping_ * dt));
  compute_forces();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float *u = u_[axis].data(), *v = velocity_[axis].data();
    const float *f = force_[axis].data(), *w = inverse_mass_.data();
    for (std::size_t i = 0; i < lattice_.size(); ++i) {
      v[i] = kept * (v[i] + t * w[i] * f[i]);
      u[i] += t * v[i];
    }
  }
}

Vec3 SpringLattice::spring_force(std::size_t node) {
  compute_forces();
  return {force_[0][node], force_[1][node], force_[2][node]};
}

void MassSpring::set_up(const ComparedScene& scene) {
  const ElasticBody& body = scene.body;
  lattice_ = std::make_unique<Lattice>(body.box_centre, body.box_size, spacing_);
  std::vector<double> shares(body.regions.size() + 1);
  const std::vector<double> materials = body.materials();
  springs_ = std::make_unique<SpringLattice>(*lattice_, [&](const Vec3& X) {
    body.material_shares(X, shares);
    double modulus = 0;
    for (std::size_t m = 0; m < shares.size(); ++m) modulus += body.shear_modulus * materials[m] * shares[m];
    return modulus;
  });
  is_held_.resize(lattice_->size());
  for (std::size_t node = 0; node < lattice_->size(); ++node) {
    is_held_[node] = lattice_->is_held(node, body);
    if (is_held_[node]) springs_->prescribe(node, Vec3::Zero());
  }
  imposed_ = impose(*lattice_, scene.landmarks);
  for (const Vec3& X : scene.points) places_.push_back(lattice_->locate(X));
  u_.assign(places_.size(), Vec3::Zero());
}

void MassSpring::tick(std::span<const Vec3> displacements) {
  for (const ImposedNode& node : imposed_) springs_->prescribe(node.node, node.displacement(displacements));
  springs_->advance(kTickPeriod);
  for (std::size_t i = 0; i < places_.size(); ++i)
    u_[i] = lattice_->interpolate(places_[i], springs_->displacements());
}

bool MassSpring::move(std::span<const Vec3> landmarks) {
  for (const ImposedNode& node : imposed_)
    if (!is_held_[node.node]) springs_->release(node.node);
  imposed_ = impose(*lattice_, landmarks);
  return true;
}

void MassSpring::read(std::span<Vec3> u) const {
  std::ranges::copy(u_, u.begin());
}

std::vector<Vec3> MassSpring::displacements_at(std::span<const Vec3> X) const {
  std::vector<Vec3> u;
  for (const Vec3& x : X) u.push_back(lattice_->interpolate(lattice_->locate(x), springs_->displacements()));
  return u;
}

}  // namespace brachy
