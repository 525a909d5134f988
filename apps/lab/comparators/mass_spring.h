#pragma once

#include <functional>
#include <memory>

#include "apps/lab/comparators/lattice.h"

namespace brachy {

/// Masses on a lattice's nodes and linear springs along its edges and the diagonals of its faces, moved by explicit
/// time steps (semi-implicit Euler) within their limit.
///
/// Every cell gives each of its edges μh/4 and each diagonal of its faces μh/2: inside, all springs are μh, which
/// on a cubic lattice is isotropic with shear modulus μ and λ = μ (ν = ¼, the only value that central springs on
/// such a lattice have; from C_ijkl = ½h⁻³ Σ k b² n_i n_j n_k n_l over a node's springs). A uniform strain is kept
/// exactly, also at faces and where moduli meet on lattice planes. Units: N, mm, s.
class SpringLattice {
 public:
  static constexpr double kDensity = 1e-9;  ///< t/mm³, that of water

  /// `shear_modulus` of each cell by its centre, N/mm².
  SpringLattice(const Lattice& lattice, const std::function<double(const Vec3&)>& shear_modulus);

  /// Prescribes a node's position: its springs do not move it.
  void prescribe(std::size_t node, const Vec3& displacement);

  /// Releases it: its springs move it again.
  void release(std::size_t node) { inverse_mass_[node] = 1 / mass_[node]; }

  /// Advances by `period` s in equal steps within the limit.
  void advance(double period);

  /// One step of `dt` s, also beyond the limit, where the lattice may be unstable.
  void step(double dt);

  double largest_step() const { return largest_step_; }  ///< s; 2/ω of Gershgorin's bound, less a tenth
  double damping() const { return damping_; }            ///< 1/s; velocities fall by 1 + damping · dt a step
  const std::array<std::vector<float>, 3>& displacements() const { return u_; }  ///< planes, mm
  Vec3 spring_force(std::size_t node);  ///< on a node by its springs, N

 private:
  static constexpr std::size_t kDirections = 9;

  void add_cells(const std::function<double(const Vec3&)>& shear_modulus);
  void find_limits();
  void compute_forces();

  Lattice lattice_;
  std::array<std::vector<float>, kDirections> stiffness_;  // by the spring's first node, N/mm
  std::vector<float> mass_, inverse_mass_;                 // inverse 0: prescribed
  std::array<std::vector<float>, 3> u_, velocity_, force_;
  std::vector<float> tension_;
  double largest_step_ = 0, damping_ = 0;
};

/// The mass-spring model of a scene: held faces fixed, the nodes nearest to the needle's landmarks imposed.
class MassSpring : public ComparedModel {
 public:
  explicit MassSpring(double spacing_mm) : spacing_(spacing_mm) {}

  void set_up(const ComparedScene& scene) override;
  void tick(std::span<const Vec3> displacements) override;
  bool move(std::span<const Vec3> landmarks) override;
  void read(std::span<Vec3> u) const override;
  std::vector<Vec3> displacements_at(std::span<const Vec3> X) const override;

 private:
  double spacing_;
  std::unique_ptr<const Lattice> lattice_;
  std::unique_ptr<SpringLattice> springs_;
  std::vector<bool> is_held_;  // by node
  std::vector<ImposedNode> imposed_;
  std::vector<Lattice::Place> places_;
  std::vector<Vec3> u_;
};

}  // namespace brachy
