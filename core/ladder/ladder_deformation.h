#pragma once

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/compact/compact_kernel.h"
#include "core/elastic/elastic_kernel.h"
#include "core/elastic/needle_rings.h"
#include "core/field/tissue_field.h"
#include "core/ladder/remainder_table.h"

namespace brachy {

/// A tick of the matrix-valued rungs (multiscale, compact_elastic, elastic, fem): landmarks → forces → field.
///
/// C(x, y) = near part + table. The near part, Kelvin's solution (or the compact kernel), is summed over the needle's
/// rings directly, by their points where a block of tissue is near and by their centres where it is farther than
/// kFarRadii; the rest is read from a table made at construction (remainder_table.h). K is assembled with the same two
/// parts and factored anew whenever a landmark's rest position changes: 3n ≤ 123 unknowns. What a landmark reads from
/// the table is kept while it and its neighbours stay put.
/// The field differs from LadderSystem's by what the table rounds off, under 1 % where the tissue is one material (tests).
/// A landmark outside the tissue's box, such as a shaft's on its way to the gland, is prepared from the kernel itself.
/// That allocates and takes tens of milliseconds: not for a daemon's loop, where a needle is known inside tissue only.
/// Threads: one caller (OpenMP over blocks if the options ask). Real-time: update does not allocate, lock or throw
/// (with landmarks inside the tissue's box, one thread).
class LadderDeformation : public TissueField {
 public:
  static constexpr double kFarRadii = 8;      ///< from here on a ring is its centre: 0.2 % of its field there
  static constexpr double kTableSpacing = 5;  ///< mm, where a region's surface is near
  static constexpr double kSmoothSpacing = 10;  ///< mm, where only the box's faces are felt

  struct Options {
    SimdTarget target = best_simd_target();
    int threads = 1;
    std::size_t max_landmarks = 64;
  };

  /// `rung` as in ladder.h. The tissue must outlive this. Takes up to some seconds (fem).
  /// Errors: UserError as make_matrix_kernel, and where the tissue is not within the body's box.
  LadderDeformation(const Tissue& tissue, std::string_view rung, const ElasticBody& body,
                    const Options& options);

  FactorStatus update(std::span<const Vec3> positions, std::span<const Vec3> displacements) noexcept override;
  Evaluation evaluation() const override { return evaluation_; }
  std::span<const std::uint32_t> touched() const override { return touched_; }
  const BlockDisplacement<float>& displacement(std::uint32_t block) const override {
    return displacements_[block];
  }
  Vec3 displacement_at(const Vec3& X) const noexcept override;
  SimdTarget target() const override { return options_.target; }

  std::span<const Vec3> forces() const { return forces_; }  ///< on the landmarks, N, of the last update
  const MatrixKernel& kernel() const { return *kernel_; }
  std::size_t bytes() const;  ///< kernel, table and columns

 private:
  /// What a landmark reads from the table, kept while its rings stay put.
  struct Column {
    Vec3 before, at, after;            // it and its neighbours at rest: what its rings follow from
    std::vector<std::uint32_t> nodes;  // that carry its force …
    std::vector<float> weights;        // … and their shares
    double modulus =
        1;  // relative, where its force acts: the tissue's, or on a region's surface the mean of its sides
    std::vector<float> held_fields;  // Q alone, filled where the modulus is not the tissue's
    std::vector<float> fields;       // three, of unit forces along x, y, z, at the nodes
    bool is_fresh = false;           // made in this update
    bool is_exact = false;           // outside the table: `fields` from the kernel, no nodes of its own
  };

  void refresh_columns(std::span<const Vec3> positions) noexcept;
  void spread(const Vec3& X, double share, Column& column) noexcept;
  void gather(Column& column, std::uint32_t landmark) noexcept;
  void take_moduli() noexcept;
  void add_nodes(const Column& column, bool held, double factor, std::vector<float>& fields) const noexcept;
  void gather_exactly(Column& column, std::uint32_t landmark);
  void assemble() noexcept;
  void prepare_exact_pairs();
  bool factor() noexcept;
  Mat3 near(const NeedleRings::Ring& a, const NeedleRings::Ring& b) const noexcept;
  Mat3 near_value(const Vec3& x, double s) const noexcept;
  Mat3 observe(const Column& a, const std::vector<float>& fields) const noexcept;
  Mat3 table_value(const Column& a, const Column& b) const noexcept;
  void solve() noexcept;
  void evaluate() noexcept;
  void evaluate_block(std::uint32_t b, std::vector<NearSource>& sources) noexcept;

  const Tissue& tissue_;
  Options options_;
  std::unique_ptr<const MatrixKernel> kernel_;
  const ElasticKernel* elastic_ = nullptr;  // one of these two is kernel_
  const CompactKernel* compact_ = nullptr;
  CompactShape shape_;
  double near_scale_ = 1;  // of a force: ŵ/μ, over 4π for the loops
  double needle_radius_;
  std::optional<RemainderTable> table_;
  const NearLoops& loops_;

  std::vector<Vec3> positions_, displacements_wanted_, forces_;
  std::vector<double> point_cores_;  // > 0: the compact kernels see points
  NeedleRings rings_;
  std::vector<std::uint8_t> is_outside_;       // of each landmark: the table
  std::vector<std::array<double, 2>> moduli_;  // relative, of each ring's share in its landmarks
  std::vector<Vec3> ring_forces_;              // near part
  std::vector<Column> columns_;
  std::vector<float> node_weight_;           // of the column being gathered, by node …
  std::vector<std::uint8_t> is_node_taken_;  // … and which nodes it has
  Eigen::MatrixXd matrix_, table_matrix_;    // K; the table's share of it
  Eigen::MatrixXd exact_matrix_;             // K between landmarks outside the table
  Eigen::VectorXd solution_;
  bool is_factored_ = false;
  Evaluation evaluation_ = Evaluation::kIdle;

  std::vector<float> node_field_;  // at the table's nodes
  std::vector<std::uint32_t> all_blocks_;
  std::span<const std::uint32_t> touched_;
  std::vector<Vec3> block_centres_;
  std::vector<BlockPoints<float>> block_points_;  // about the block's centre, mm
  std::vector<GridPoint> grid_points_;            // blocks × kBlockSize
  std::vector<BlockDisplacement<float>> displacements_;
  std::vector<std::vector<NearSource>> sources_;  // one for each thread
};

}  // namespace brachy
