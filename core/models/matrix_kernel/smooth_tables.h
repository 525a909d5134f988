#pragma once

#include <memory>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/kernels/matrix_kernel.h"
#include "core/models/matrix_kernel/remainder_table.h"

namespace brachy {

/// The constant part of SmoothField: what it reads in every tick and never writes. It depends on the tissue and the
/// kernel alone and takes up to some seconds (fem) to make, so that all fields of one SimulationModel share one.
/// Threads: const functions and members from any.
struct SmoothTables {
  static constexpr double kRegionSpacing = 5;   ///< mm between nodes, where a region's surface is near
  static constexpr double kSmoothSpacing = 10;  ///< mm, where only the box's faces are felt

  /// Neither tissue nor kernel is needed afterwards.
  SmoothTables(const Tissue& tissue, const ElasticKernel& kernel, SimdTarget target,
               const SetUp& set_up = {});
  SmoothTables(const SmoothTables&) = delete;
  SmoothTables& operator=(const SmoothTables&) = delete;

  std::size_t bytes() const { return remainder.bytes() + grid_points.size() * sizeof(GridPoint); }

  /// How a block is read: all of its points from the table; or, where it is small for the table's spacing, a parabola
  /// through kStencil of them, the middle of its box, its faces' and three edges' (at grid_points[first] on).
  struct BlockReading {
    std::size_t first = 0;
    bool is_parabola = false;
    Eigen::Vector3f half = Eigen::Vector3f::Zero();  ///< of the box, mm
  };
  static constexpr std::size_t kStencil = 10;

  RemainderTable remainder;
  std::vector<GridPoint> grid_points;  ///< where points lie in it
  std::vector<BlockReading> blocks;    ///< of the tissue

 private:
  void add_block(const Tissue& tissue, const Block& block);
};

/// The tables of `kernel`'s smooth part over a tissue within its body's box; null where it has none: the compact
/// kernels.
std::shared_ptr<const SmoothTables> make_smooth_tables(const Tissue& tissue, const MatrixKernel& kernel,
                                                       SimdTarget target, const SetUp& set_up = {});

}  // namespace brachy
