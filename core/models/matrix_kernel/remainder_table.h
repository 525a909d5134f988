#pragma once

#include <cstdint>
#include <vector>

#include "core/base/set_up.h"
#include "core/elasticity/elastic_kernel.h"
#include "core/geometry/tissue/tissue.h"
#include "core/models/matrix_kernel/near_loops.h"

namespace brachy {

/// The smooth part of an elastic kernel, D(x, y) = (P − ŵQ)/μ (remainder.h), between the nodes of a grid over a tissue:
/// it replaces some hundred sources on walls and capsule in a tick. Between nodes it is cubic in x and
/// in y, or trilinear on the remainder's own planes where it has them (fem). ŵ is the weight of the material
/// that most of the tissue is made of. Where the tissue is mixed, D = (P − wQ + (w − ŵ)G)/μ with the nodes spread over
/// their spacing, w of both nodes. Where the body has regions and the tissue is not mixed, Q is kept as well, for
/// landmarks on a region's surface, where w is another.
/// Memory: (3M)² floats for M nodes, twice that with Q. Threads: const functions may be called from
/// any. Real-time: they do not allocate.
class RemainderTable {
 public:
  /// Most nodes where the remainder is smooth: of tissue more than about 90 mm wide they lie farther apart.
  static constexpr int kMaxSmoothNodes = 1000;

  /// Nodes lie at most `spacing` mm apart, four at least along each axis.
  RemainderTable(const Tissue& tissue, const ElasticKernel& kernel, double spacing, SimdTarget target,
                 const SetUp& set_up = {});

  std::size_t nodes() const { return static_cast<std::size_t>(count_[0]) * count_[1] * count_[2]; }
  /// Numbers of floats of a field at the nodes (interleaved x, y, z, x fastest), to the next row and slice of nodes; a
  /// field has `field_size` floats, of which the last few are never written.
  std::size_t row() const { return 3 * std::size_t{count_[0]}; }
  std::size_t slice() const { return row() * count_[1]; }
  std::size_t field_size() const { return 3 * nodes() + 4; }

  /// The cell of X and its weights; a point outside is moved to the nearest one inside.
  GridPoint locate(const Vec3& X) const noexcept;
  /// The same with `slopes` the derivatives of the weights, 1/mm.
  GridPoint locate(const Vec3& X, GridPoint& slopes) const noexcept;
  /// Whether the weights at X extrapolate along an axis from the middle of their nodes: in the grid's outermost cells.
  bool is_at_end(const Vec3& X, double within, std::size_t axis) const noexcept;
  const std::vector<double>& planes(std::size_t axis) const { return planes_[axis]; }
  bool is_linear() const { return is_linear_; }
  std::array<std::uint32_t, 3> counts() const { return count_; }
  /// The node (kx, ky, kz), each 0 … 3, of a located point's stencil.
  std::uint32_t node(const GridPoint& p, std::size_t kx, std::size_t ky, std::size_t kz) const {
    return p.base + static_cast<std::uint32_t>(kx + count_[0] * (ky + count_[1] * kz));
  }

  /// field += weight · D(·, node) e_axis: the nodes' displacement, mm/N.
  void add_column(std::uint32_t node, std::size_t axis, float weight, float* field) const noexcept;
  bool keeps_held() const { return !held_.empty(); }
  /// The same of Q/μ; only where it is kept.
  void add_held_column(std::uint32_t node, std::size_t axis, float weight, float* field) const noexcept;

  /// Whether X lies in the grid, within half a millimetre.
  bool covers(const Vec3& X) const noexcept;
  Vec3 position(std::uint32_t node) const noexcept;  ///< mm

  /// Whether it is of more than one material: then so much is added to s by what the nodes smooth.
  bool is_mixed() const { return smooth_s_ > 0; }
  double smooth_s() const { return smooth_s_; }  ///< mm²
  /// Of the nodes' weights at X, between the table's planes, averaged over directions, mm².
  double variance_of_nodes(const Vec3& X) const noexcept;

  double near_weight() const { return near_weight_; }  ///< ŵ
  double modulus() const { return 1 / near_weight_; }  ///< relative, of the tissue
  std::size_t bytes() const { return (table_.size() + held_.size()) * sizeof(float); }

 private:
  void place_planes(const Tissue& tissue, const Remainder* remainder, double spacing);
  std::vector<Vec3> positions() const;
  std::vector<std::uint32_t> nodes_by_slices(const Remainder& remainder) const;
  /// D between nodes i and j, and its transpose between j and i.
  void set_pair(std::vector<float>& table, std::uint32_t i, std::uint32_t j, const Mat3& D) const;
  void fill(const ElasticKernel& kernel);
  void fill_by_columns(const ElasticKernel& kernel, bool is_mixed, const SetUp& set_up);

  std::array<std::vector<double>, 3> planes_;  // along x, y, z, mm
  bool is_linear_ = false;
  std::array<std::uint32_t, 3> count_{};
  double near_weight_ = 1, smooth_s_ = 0;
  const NearLoops& loops_;
  std::vector<float> table_, held_;  // row 3 node + axis
};

}  // namespace brachy
