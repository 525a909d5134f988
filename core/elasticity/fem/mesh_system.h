#pragma once

#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/elasticity/fem/band_factor.h"
#include "core/elasticity/fem/hex_mesh.h"
#include "core/kernels/point_groups.h"

namespace brachy {

/// A mesh with its stiffness factored: forces at points in, displacements at points out, where some nodes are fixed.
/// A point's force acts on the nodes of its cell by their shares, and a point is observed by the same shares;
/// points outside the mesh are taken to its nearest point. Moduli relative to the tissue outside all regions, mm,
/// N.
/// Threads: const functions may be called from any. They allocate.
class MeshSystem {
 public:
  /// Shear modulus at each of a cell's 2 × 2 × 2 Gauss points.
  using CellModulus = std::function<std::array<double, 8>(const HexMesh& mesh, const HexMesh::Place& cell)>;
  /// Whether the node of a place is fixed.
  using IsFixed = std::function<bool(const HexMesh& mesh, const HexMesh::Place& place)>;
  /// Displacement of a fixed node at X by a unit force on group g of b; none: 0.
  using FixedMotion = std::function<Mat3(const Vec3& X, const PointGroups& b, std::size_t g)>;

  MeshSystem(HexMesh mesh, double poisson, const CellModulus& modulus, const IsFixed& is_fixed,
             SimdTarget target);

  /// Displacements of groups a, 3|a| × 3|b|, by unit forces on groups b.
  Eigen::MatrixXd between(const PointGroups& a, const PointGroups& b, const FixedMotion& fixed_motion) const;
  /// Displacements of groups a, 3|a| × m, by m sets of forces on groups b (3|b| × m).
  Eigen::MatrixXd fields(const PointGroups& a, const PointGroups& b, const Eigen::MatrixXd& forces,
                         const FixedMotion& fixed_motion) const;

  const HexMesh& mesh() const { return mesh_; }
  int rows() const { return factor_.rows(); }
  std::size_t bytes() const;

 private:
  /// Right-hand sides that are solved together.
  using Forces = Eigen::Matrix<double, 3, BandRow::kCount, Eigen::RowMajor>;
  struct Load {
    std::size_t group;
    Forces forces;
  };
  /// A group's displacement: shares of rows of x.
  struct Term {
    int row;  ///< the first of three
    double share;
  };
  using Observation = std::vector<Term>;
  /// Stiffness between a free node's rows and a fixed node.
  struct Coupling {
    int row;
    std::size_t fixed;
    Mat3 stiffness;
  };

  void assemble(double poisson, const CellModulus& modulus);
  void merge_couplings();
  std::vector<Observation> observe(const PointGroups& groups) const;
  /// Right-hand sides of some loads into x, padded_rows() rows of zeros; returns the first row that is not zero.
  int load(std::span<const Load> loads, const PointGroups& b, const std::vector<Observation>& of_b,
           const FixedMotion& fixed_motion, BandRow* x) const;
  /// The same of unit forces along x, y and z on each of up to eight groups.
  int load_units(std::span<const std::size_t> groups, const PointGroups& b,
                 const std::vector<Observation>& of_b, const FixedMotion& fixed_motion, BandRow* x) const;
  /// What moved fixed nodes do to the right-hand sides.
  int load_fixed(const std::vector<Forces>& motions, BandRow* x) const;
  int first_row(const std::vector<Observation>& observations) const;
  /// Groups a in a solution x: out, 3|a| × (up to 24).
  void read(const std::vector<Observation>& of_a, const BandRow* x, Eigen::Ref<Eigen::MatrixXd> out) const;

  HexMesh mesh_;
  std::vector<int> rows_;    // first of a node's three; −1 − f for fixed node f
  std::vector<Vec3> fixed_;  // positions
  std::vector<Coupling> couplings_;
  BandFactor factor_;
};

}  // namespace brachy
