#pragma once

#include <memory>

#include "apps/lab/comparators/lattice.h"

namespace brachy {

/// ChainMail in space (S. Gibson, "3D ChainMail: a fast algorithm for deforming volumetric objects", Symposium on
/// Interactive 3D Graphics 1997): the links of a lattice are slack. A neighbour of a moved node follows only so far
/// that their distance along the link lies within `least` and `most` of the rest length and sideways within `shear`
/// of it; then its neighbours are processed, first come, first served, each moved once. The result depends on that
/// order where chains meet.
class ChainMailLattice {
 public:
  /// Shares of the rest length.
  struct Limits {
    double least = 0.9, most = 1.1, shear = 0.1;
  };
  ChainMailLattice(const Lattice& lattice, const Limits& limits);

  void hold(std::size_t node) { is_held_[node] = true; }  ///< it never moves, and does not propagate

  struct Move {
    std::size_t node;
    Vec3 displacement;  ///< from rest, mm
  };
  /// From rest: places the moved nodes, in their order, and lets the others follow.
  void deform(std::span<const Move> moves);

  const std::array<std::vector<float>, 3>& displacements() const { return u_; }  ///< planes, mm

 private:
  void enqueue_neighbours(std::size_t node);
  bool follow(std::size_t node, std::size_t sponsor, std::size_t axis, int sign);
  struct Visit {
    std::size_t node, sponsor;
    std::size_t axis;  ///< of the link
    int sign;          ///< node − sponsor along it
  };

  Lattice lattice_;
  Limits limits_;
  std::vector<bool> is_held_, has_moved_;
  std::vector<Visit> queue_;
  std::array<std::vector<float>, 3> u_;
};

/// The ChainMail of a scene: held faces fixed, the nodes nearest to the needle's landmarks moved.
class ChainMail : public ComparedModel {
 public:
  explicit ChainMail(double spacing_mm) : spacing_(spacing_mm) {}

  void set_up(const ComparedScene& scene) override;
  void tick(std::span<const Vec3> displacements) override;
  bool move(std::span<const Vec3> landmarks) override;
  void read(std::span<Vec3> u) const override;
  std::vector<Vec3> displacements_at(std::span<const Vec3> X) const override;

 private:
  double spacing_;
  std::unique_ptr<const Lattice> lattice_;
  std::unique_ptr<ChainMailLattice> mail_;
  std::vector<ImposedNode> imposed_;
  std::vector<ChainMailLattice::Move> moves_;
  std::vector<Lattice::Place> places_;
  std::vector<Vec3> u_;
};

}  // namespace brachy
