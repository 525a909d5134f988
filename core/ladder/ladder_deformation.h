#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/elastic/needle_rings.h"
#include "core/field/tissue_field.h"
#include "core/kernels/matrix_kernel.h"
#include "core/ladder/ladder_cells.h"
#include "core/ladder/near_field.h"
#include "core/ladder/smooth_field.h"

namespace brachy {

/// Errors: UserError where the tissue is not within the body's box.
void require_in_box(const Tissue& tissue, const ElasticBody& body);

/// A tick of the matrix-valued rungs (multiscale, compact_elastic, elastic, fem): landmarks → forces → field.
///
/// C(x, y) = near part + smooth part: Kelvin's solution (or the compact kernel) summed over the needle's rings directly
/// (near_field.h), and what bounds and regions add read from a table made at construction (smooth_field.h). K is
/// assembled with the same two parts and factored anew whenever a landmark's rest position changes: 3n ≤ 123 unknowns.
/// The field differs from LadderSystem's by what the table rounds off, under 1 % where the tissue is one material (tests).
/// A landmark outside the tissue's box, such as a shaft's on its way to the gland, is prepared from the kernel itself.
/// That allocates and takes tens of milliseconds: not for a daemon's loop, where a needle is known inside tissue only.
/// Threads: one caller (OpenMP over blocks if the options ask). Real-time: update does not allocate, lock or throw
/// (with landmarks inside the tissue's box, one thread).
class LadderDeformation : public TissueField {
 public:
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
  void rescale(double scale) noexcept override;
  Evaluation evaluation() const override { return evaluation_; }
  double condition() const override { return condition_; }
  std::span<const std::uint32_t> touched() const override { return touched_; }
  const BlockDisplacement<float>& displacement(std::uint32_t block) const override {
    return displacements_[block];
  }
  Vec3 displacement_at(const Vec3& X) const noexcept override;
  const CellField& cells() noexcept override;
  std::size_t max_sources() const override { return options_.max_landmarks * NeedleRings::kMaxRingsBetween; }
  double total_force_n() const override;
  SimdTarget target() const override { return options_.target; }

  std::span<const Vec3> forces() const { return forces_; }  ///< on the landmarks, N, of the last update
  const MatrixKernel& kernel() const { return *kernel_; }
  std::size_t bytes() const;  ///< kernel, table and columns

 private:
  void assemble() noexcept;
  FactorStatus factor() noexcept;
  void solve() noexcept;
  void spread_forces() noexcept;
  void evaluate() noexcept;
  void evaluate_block(std::uint32_t b, std::vector<NearSource>& sources) noexcept;

  Options options_;
  double needle_radius_;
  std::unique_ptr<const MatrixKernel> kernel_;
  std::optional<NearField> near_;
  std::optional<SmoothField> smooth_;  // the compact rungs have none
  std::optional<LadderCells> cells_;
  std::vector<double> point_cores_;  // > 0: the compact kernels see points

  std::vector<Vec3> positions_, displacements_wanted_, forces_;
  NeedleRings rings_;
  std::vector<Vec3> ring_forces_;  // near part
  Eigen::MatrixXd matrix_;         // K's lower triangle, then its factor
  Eigen::VectorXd solution_;
  Eigen::MatrixXd scratch_;  // 3n × 3, for the condition number
  bool is_factored_ = false;
  double condition_ = 1;
  Evaluation evaluation_ = Evaluation::kIdle;

  std::vector<std::uint32_t> all_blocks_;
  std::span<const std::uint32_t> touched_;
  std::vector<BlockDisplacement<float>> displacements_;
  std::vector<std::vector<NearSource>> sources_;  // one for each thread
};

}  // namespace brachy
