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
#include "core/rbf/inverse_block.h"

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
    /// Of one landmark alone, on the compact rungs; 0: what their kernel has. Displacements do not depend on it. `elastic`
    /// and `fem` know their forces.
    double landmark_stiffness_n_per_mm = 0;
  };

  /// `rung` as in ladder.h. The tissue must outlive this. Takes up to some seconds (fem).
  /// Errors: UserError as make_matrix_kernel, and where the tissue is not within the body's box.
  LadderDeformation(const Tissue& tissue, std::string_view rung, const ElasticBody& body,
                    const Options& options);

  FactorStatus place(std::span<const Vec3> positions, std::span<const double> cores = {}) noexcept override;
  FactorStatus update(std::span<const Vec3> positions, std::span<const Vec3> displacements,
                      std::span<const double> cores = {}) noexcept override;
  void reactions(std::span<const Vec3> displacements, std::span<Vec3> forces) noexcept override;
  void axial_stiffness(std::size_t first, std::span<const Vec3> axes,
                       Eigen::Ref<Eigen::MatrixXd> H) noexcept override;
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

  /// On the landmarks, of the last update, N by the kernel's own compliance.
  std::span<const Vec3> forces() const { return forces_; }
  const MatrixKernel& kernel() const { return *kernel_; }
  std::size_t bytes() const;  ///< kernel, table and columns

 private:
  void assemble() noexcept;
  FactorStatus factor() noexcept;
  bool is_placed(std::span<const Vec3> positions, std::span<const double> cores) const noexcept;
  void solve(std::span<const Vec3> displacements, std::span<Vec3> forces) noexcept;
  void spread_forces() noexcept;
  void evaluate() noexcept;
  void evaluate_block(std::uint32_t b, std::vector<NearSource>& sources) noexcept;

  Options options_;
  double needle_radius_;
  std::unique_ptr<const MatrixKernel> kernel_;
  std::optional<NearField> near_;
  std::optional<SmoothField> smooth_;  // the compact rungs have none
  std::optional<LadderCells> cells_;
  double force_scale_ = 1;  // from the kernel's own forces to N

  // The placed landmarks.
  std::vector<Vec3> positions_;
  std::vector<double> cores_;
  NeedleRings rings_;
  Eigen::MatrixXd matrix_;  // K's lower triangle, then its factor
  Eigen::VectorXd solution_;
  Eigen::MatrixXd scratch_;  // 3n × 3, for the condition number
  InverseBlock inverse_block_;
  bool is_factored_ = false;
  double condition_ = 1;

  // The field's landmarks, which may be others.
  bool is_field_of_placed_ = false;
  std::vector<Vec3> displacements_wanted_, forces_;
  NeedleRings field_rings_;
  std::vector<Vec3> ring_forces_;  // near part
  Evaluation evaluation_ = Evaluation::kIdle;

  std::vector<std::uint32_t> all_blocks_;
  std::span<const std::uint32_t> touched_;
  std::vector<BlockDisplacement<float>> displacements_;
  std::vector<std::vector<NearSource>> sources_;  // one for each thread
};

}  // namespace brachy
