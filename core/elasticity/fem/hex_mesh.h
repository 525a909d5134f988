#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/elasticity/elastic_body.h"

namespace brachy {

/// Planes along each axis, ascending, mm.
using MeshPlanes = std::array<std::vector<double>, 3>;

/// How fine a body's mesh is: one rule for bodies of any size. Small regions are far from the walls in cells; there the
/// mesh is as coarse as `max_work` asks for: it grows by up to `coarse_growth`, then cells become larger down to
/// `least_cells`, then it grows faster. (Growing by 2 at once costs 2 % of the field, by 1.6 under 1 %.)
struct MeshSizes {
  int core_cells = 250;  ///< equal cells, nearly cubes, in the bounding box of the regions
  double margin = 0.6;   ///< of the bounding box to the regions, in cells
  double growth = 1.4;   ///< each cell over the one before, from there to the walls
  double coarse_growth = 1.6;
  int least_cells = 6;
  double max_work = 9e10;  ///< multiply-adds of a table over the tissue: 5 to 9 s of a core (table_work)
};

/// A box along the axes, mm.
struct MeshBounds {
  Vec3 min, max;
};

/// Planes of a body's mesh, its walls the first and the last, for a table over `tissue`; none: the middle half of the
/// box and what the regions need beyond it.
/// Errors: UserError where no mesh is within sizes.max_work.
MeshPlanes mesh_planes(const ElasticBody& body, const MeshSizes& sizes,
                       const std::optional<MeshBounds>& tissue = {});

/// Multiply-adds of solving for the forces on all nodes that tissue lies between (RemainderTable).
double table_work(const MeshPlanes& planes, const MeshBounds& tissue);

/// The same with one more cell beyond every wall, as large as the last before it.
MeshPlanes with_outer_cells(MeshPlanes planes);

/// A rectilinear mesh of cells with eight nodes. Nodes are numbered along the axis with the fewest planes first,
/// the one with the most last, so that nodes of a cell are as near in number as can be.
class HexMesh {
 public:
  explicit HexMesh(MeshPlanes planes);

  using Place = std::array<int, 3>;  ///< a plane along each axis; of a cell: its lower ones

  int nodes() const { return stride_[slowest_] * planes(slowest_); }
  const MeshPlanes& all_planes() const { return planes_; }
  int planes(std::size_t axis) const { return static_cast<int>(planes_[axis].size()); }
  int node(const Place& p) const { return p[0] * stride_[0] + p[1] * stride_[1] + p[2] * stride_[2]; }
  Place place(int node) const;
  Vec3 position(const Place& p) const { return {at(0, p[0]), at(1, p[1]), at(2, p[2])}; }
  /// A cell's node a, 0 … 7: bit k of a says which of its two planes along axis k.
  int cell_node(const Place& cell, int a) const {
    return node({cell[0] + (a & 1), cell[1] + (a >> 1 & 1), cell[2] + (a >> 2)});
  }
  Vec3 cell_size(const Place& cell) const {
    return position({cell[0] + 1, cell[1] + 1, cell[2] + 1}) - position(cell);
  }

  /// Trilinear interpolation at a point: nodes and their shares, which sum to 1.
  struct Shape {
    std::array<int, 8> node;
    std::array<double, 8> share;
  };
  /// Of the point of the mesh that is nearest to X.
  Shape shape(const Vec3& X) const;

 private:
  double at(std::size_t axis, int plane) const { return planes_[axis][static_cast<std::size_t>(plane)]; }

  MeshPlanes planes_;
  std::array<int, 3> stride_{};
  std::array<std::size_t, 3> by_stride_{};  // axes, the one with the fewest planes first
  std::size_t slowest_ = 0;
};

/// Stiffness of a cell of eight nodes (displacements node after node, HexMesh::cell_node; N/mm per mm), for
/// Poisson's ratio `poisson` and the shear modulus at each of the 2 × 2 × 2 Gauss points, numbered as nodes.
/// Dilatation is the cell's mean (B-bar: T. J. R. Hughes, Int. J. Numer. Meth. Eng. 15 (1980) 1413), so that it
/// does not lock as ν → ½.
Eigen::Matrix<double, 24, 24> hex_stiffness(const Vec3& size, double poisson,
                                            const std::array<double, 8>& modulus);

}  // namespace brachy
