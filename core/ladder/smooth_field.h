#pragma once

#include "core/ladder/landmark_columns.h"
#include "core/ladder/remainder_table.h"

namespace brachy {

/// The smooth part of an elastic rung in a tick: landmarks' forces → the table's nodes → a tissue's points. The table is
/// made at construction, which takes up to some seconds (fem).
/// Threads: one; const functions from any. Real-time: as LandmarkColumns.
class SmoothField {
 public:
  static constexpr double kRegionSpacing = 5;   ///< mm between nodes, where a region's surface is near
  static constexpr double kSmoothSpacing = 10;  ///< mm, where only the box's faces are felt

  /// The kernel must outlive this.
  SmoothField(const Tissue& tissue, const ElasticKernel& kernel, SimdTarget target,
              std::size_t max_landmarks);
  SmoothField(const SmoothField&) = delete;
  SmoothField& operator=(const SmoothField&) = delete;

  LandmarkColumns& columns() { return columns_; }

  /// w of the tissue's own modulus, for which near parts are weighted.
  double near_weight() const { return table_.near_weight(); }
  /// What takes the near part of a pair to the weight of the pair: rings' shares a and b, or a's share and tissue.
  double near_factor(std::size_t ring_a, std::size_t side_a, std::size_t ring_b, std::size_t side_b) const {
    return factor_between(columns_.modulus(ring_a, side_a), columns_.modulus(ring_b, side_b));
  }
  double near_factor(std::size_t ring, std::size_t side) const {
    return factor_between(columns_.modulus(ring, side), table_.modulus());
  }

  /// Takes the landmarks' forces, n, N, for the functions below.
  void set_forces(std::span<const Vec3> forces) noexcept;
  void rescale(double scale) noexcept;  ///< multiplies their field
  /// u = the field at the points of block b.
  void interpolate(std::uint32_t b, BlockDisplacement<float>& u) const noexcept;
  void add_displacement_at(const Vec3& X, Vec3& u) const noexcept;  ///< u += the field at X, mm

  Mat3 gradient_at(const Vec3& X) const noexcept;  ///< ∇ of the field between the table's nodes
  /// Over a cube of half side `half` mm about X the gradient differs from that at X by at most this (nuclear norm).
  double gradient_varies(const Vec3& X, double half) const noexcept;

  std::size_t bytes() const;

 private:
  void measure_roughness() noexcept;

  double factor_between(double k_a, double k_b) const { return 2 / ((k_a + k_b) * table_.near_weight()); }

  RemainderTable table_;
  LandmarkColumns columns_;  // refers to table_
  const NearLoops& loops_;
  std::vector<float> node_field_;
  double bend_ = 0, twist_ = 0, jump_ = 0;  // of the nodes' field: see measure_roughness
  std::vector<GridPoint> grid_points_;      // blocks × kBlockSize
};

}  // namespace brachy
