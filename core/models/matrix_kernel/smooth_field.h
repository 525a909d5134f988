#pragma once

#include <memory>

#include "core/injectivity/cell_field.h"
#include "core/models/matrix_kernel/landmark_columns.h"
#include "core/models/matrix_kernel/smooth_tables.h"

namespace brachy {

/// The smooth part of an elastic model in a tick: landmarks' forces → the table's nodes → a tissue's points.
/// The tables are constant and may be shared with other fields; this has what changes from tick to tick.
/// Threads: one; const functions from any. Real-time: as LandmarkColumns.
class SmoothField {
 public:
  /// `tables` are the kernel's (make_smooth_tables), not null. The kernel must outlive this.
  SmoothField(const ElasticKernel& kernel, std::shared_ptr<const SmoothTables> tables, SimdTarget target,
              std::size_t max_landmarks);
  SmoothField(const SmoothField&) = delete;
  SmoothField& operator=(const SmoothField&) = delete;

  LandmarkColumns& columns() { return columns_; }

  /// w of the tissue's own modulus, for which near parts are weighted.
  double near_weight() const { return table_.near_weight(); }
  /// Factor from the near part of a pair to the weight of the pair: rings' shares a and b, or a's share and tissue.
  double near_factor(std::size_t ring_a, std::size_t side_a, std::size_t ring_b, std::size_t side_b) const {
    return factor_between(columns_.modulus(ring_a, side_a), columns_.modulus(ring_b, side_b));
  }
  double near_factor(std::size_t ring, std::size_t side) const {
    return factor_between(columns_.modulus(ring, side), columns_.field_modulus(ring, side));
  }

  /// Sets the landmarks' forces (n, N) that the functions below use.
  void set_forces(std::span<const Vec3> forces) noexcept;
  void rescale(double scale) noexcept;  ///< multiplies their field
  /// u = the field at the points of block b, which lie at X about the middle of its box.
  void interpolate(std::uint32_t b, const BlockPoints<float>& X, BlockDisplacement<float>& u) const noexcept;
  void add_displacement_at(const Vec3& X, Vec3& u) const noexcept;  ///< u += the field at X, mm

  Mat3 gradient_at(const Vec3& X) const noexcept;  ///< ∇ of the field between the table's nodes
  /// Over a cube of half side `half` mm about X the gradient differs from that at X by at most this (nuclear norm).
  double gradient_varies(const Vec3& X, double half) const noexcept;

  /// At least the nuclear norm of the gradient anywhere between the table's nodes.
  double steepest() const { return steepest_; }

  /// Adds its bounds over a cell.
  void add_bounds(const Cell& cell, CellBounds& bounds) const noexcept;

  std::size_t bytes() const;  ///< with the tables

 private:
  void measure_roughness() noexcept;

  double factor_between(double k_a, double k_b) const { return 2 / ((k_a + k_b) * table_.near_weight()); }

  std::shared_ptr<const SmoothTables> tables_;
  const RemainderTable& table_;  // the tables'
  LandmarkColumns columns_;
  const NearLoops& loops_;
  std::vector<float> node_field_;
  double bend_ = 0, twist_ = 0, jump_ = 0;  // of the nodes' field: see measure_roughness
  double steepest_ = 0;
};

}  // namespace brachy
