#pragma once

#include <array>
#include <cstdint>

#include "apps/lab/comparators/compared_model.h"

namespace brachy {

/// A regular lattice of nodes that fills a body's box, faces included, in the order x fastest, then y, then z.
class Lattice {
 public:
  /// `spacing` in mm is rounded so that whole cells fill the box along each axis.
  Lattice(const Vec3& box_centre, const Vec3& box_size, double spacing);

  std::size_t size() const { return count_[0] * count_[1] * count_[2]; }
  const std::array<std::size_t, 3>& count() const { return count_; }  ///< nodes along x, y, z
  const Vec3& cell() const { return cell_; }                          ///< mm
  std::size_t stride(std::size_t axis) const {
    return axis == 0 ? 1 : axis == 1 ? count_[0] : count_[0] * count_[1];
  }

  std::array<std::size_t, 3> place(std::size_t node) const;
  std::size_t node(const std::array<std::size_t, 3>& place) const;
  Vec3 position(std::size_t node) const;                          ///< mm
  std::size_t nearest(const Vec3& X) const;                       ///< node; of those in the box
  bool is_held(std::size_t node, const ElasticBody& body) const;  ///< on a held face

  /// A point in its cell, for trilinear interpolation; points outside take the nearest cell's polynomial.
  struct Place {
    std::uint32_t first = 0;  ///< the cell's least node
    std::array<float, 3> share{};
  };
  Place locate(const Vec3& X) const;
  /// u of planes ux, uy, uz at a place, mm.
  Vec3 interpolate(const Place& place, const std::array<std::vector<float>, 3>& u) const;

 private:
  Vec3 min_, cell_;
  std::array<std::size_t, 3> count_;
};

/// Which lattice nodes a needle moves: those nearest to its landmarks, each by the mean of its landmarks'
/// displacements.
struct ImposedNode {
  std::size_t node;
  std::vector<std::size_t> landmarks;
  Vec3 displacement(std::span<const Vec3> of_landmarks) const;
};
std::vector<ImposedNode> impose(const Lattice& lattice, std::span<const Vec3> landmarks);

}  // namespace brachy
