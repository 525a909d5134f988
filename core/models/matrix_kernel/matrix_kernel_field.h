#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/elasticity/beam_columns.h"
#include "core/elasticity/needle_rings.h"
#include "core/kernels/matrix_kernel.h"
#include "core/models/matrix_kernel/matrix_kernel_cells.h"
#include "core/models/matrix_kernel/near_field.h"
#include "core/models/matrix_kernel/near_matrix.h"
#include "core/models/matrix_kernel/smooth_field.h"
#include "core/models/tissue_field.h"
#include "core/solve/symmetric_factor.h"

namespace brachy {

/// Errors: UserError where the tissue is not within the body's box.
void require_in_box(const Tissue& tissue, const ElasticBody& body);

/// A tick of the matrix-valued models (compact_elastic, elastic, fem): landmarks → forces → field.
///
/// C(x, y) = near part + smooth part: Kelvin's solution (or the compact kernel) summed over the needle's rings directly
/// (near_field.h), and what boundary and regions add, read from tables made beforehand (smooth_tables.h). K is
/// assembled with the same two parts and factored again whenever a landmark's rest position changes, where there are
/// many from the first that did (SymmetricFactor).
/// The field differs from MatrixKernelSystem's by the table's interpolation error, under 1 % where the tissue is
/// one material (tests). A landmark outside the tissue's box, such as a shaft's on its way to the gland, is
/// prepared from the kernel itself. That allocates and takes tens of milliseconds: a real-time loop must not do it,
/// and its needles have landmarks inside the tissue only.
/// Threads: one caller (OpenMP over blocks if the options ask). Real-time: update does not allocate, lock or throw
/// (with landmarks inside the tissue's box, one thread).
class MatrixKernelField : public TissueField {
 public:
  struct Options {
    SimdTarget target = best_simd_target();
    int threads = 1;
    std::size_t max_landmarks = 64;
    /// Of one landmark alone, with compact_elastic; 0: what its kernel has. Displacements do not depend on it.
    /// `elastic` and `fem` know their forces.
    double landmark_stiffness_n_per_mm = 0;
    /// Whether evaluate and update evaluate the tissue's points. Not where a MatrixComposition does it.
    bool evaluates_points = true;
    /// Whether K, or its factor, is kept while only compliances change: where needles bend or the body moves.
    bool keeps_matrix = false;
    WorkBudget budget = {};  ///< of a tick: at how many rings folds are looked for
  };

  /// `kernel` was made for `body` (make_matrix_kernel), `tables` for kernel, tissue and options.target
  /// (make_smooth_tables); several fields may share both. The tissue must outlive this.
  /// Errors: UserError where the tissue is not within the body's box.
  MatrixKernelField(const Tissue& tissue, std::shared_ptr<const MatrixKernel> kernel,
                    std::shared_ptr<const SmoothTables> tables, const ElasticBody& body,
                    const Options& options);

  /// The same with a kernel and tables of its own. Takes up to some seconds (fem).
  /// Errors: UserError also as make_matrix_kernel.
  MatrixKernelField(const Tissue& tissue, std::string_view model_name, const ElasticBody& body,
                    const Options& options);

  std::span<const std::uint32_t> touched() const override { return touched_; }
  const BlockDisplacement<float>& displacement(std::uint32_t block) const override {
    return displacements_[block];
  }
  Vec3 displacement_at(const Vec3& X) const noexcept override;
  void displacements_at(std::span<const Vec3> X, std::span<Vec3> u) noexcept override;
  const CellField& cells() noexcept override;
  /// Rings, a tip's point, and one for the correction of each landmark (matrix_composition.h).
  std::size_t max_sources() const override { return max_landmarks() * (NeedleRings::kMaxRingsBetween + 2); }

  /// Of the factorized landmarks, mm: given, or found for a given stiffness; 0: the model's own rule.
  std::span<const double> cores() const { return factorized_.cores; }
  /// On the landmarks, of the last update, N by the kernel's own compliance.
  std::span<const Vec3> forces() const { return weights(); }
  const MatrixKernel& kernel() const { return *kernel_; }

  /// What the field of the last evaluate is made of.
  struct Parts {
    const NearField& near;
    const SmoothField* smooth;  ///< null: none
    const NeedleRings& rings;
    std::span<const Vec3> ring_forces;  ///< N
  };
  Parts parts() const { return {*near_, smooth_ ? &*smooth_ : nullptr, shown_.rings, shown_.ring_forces}; }
  double needle_radius() const { return needle_radius_; }  ///< mm
  int threads() const { return threads_; }

  std::size_t bytes() const;  ///< kernel, tables and columns, shared or not

 private:
  MatrixKernelField(const Tissue& tissue, std::shared_ptr<const MatrixKernel> kernel, const ElasticBody& body,
                    const Options& options);

  FactorStatus do_factorize(const LandmarkSet& landmarks, double& condition) noexcept override;
  void do_solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept override;
  void do_project_inverse(std::size_t first, std::span<const Vec3> axes,
                          Eigen::Ref<Eigen::MatrixXd> H) noexcept override;
  void do_rigid_stiffness(std::span<const std::uint32_t> group_of, std::span<const Vec3> motions,
                          std::span<double> stiffness) noexcept override;
  Evaluation do_evaluate(bool is_new_set, std::span<Vec3> weights) noexcept override;
  void do_rescale(double scale) noexcept override;

  double core_in_free_space(double stiffness_n_per_mm) const noexcept;
  void find_cores(std::span<const LandmarkSpread> spreads) noexcept;
  void limit_core(std::size_t r, double widest) noexcept;
  bool narrow_cores() noexcept;
  FactorStatus assemble_and_factor(const LandmarkCompliance& compliance, bool adds_beams,
                                   double& condition) noexcept;
  void assemble(Eigen::Ref<Eigen::MatrixXd> K) noexcept;
  bool remembers(const LandmarkSet::Revision& revision) const noexcept;
  FactorStatus factor(double& condition) noexcept;
  void add_beams(double scale) noexcept;
  void spread_forces(std::span<const Vec3> forces) noexcept;
  void evaluate_blocks() noexcept;
  void evaluate_block(std::uint32_t b, std::vector<NearSource>& sources) noexcept;

  int threads_;
  bool evaluates_points_;
  double needle_radius_;
  std::shared_ptr<const MatrixKernel> kernel_;
  std::optional<NearField> near_;
  std::optional<SmoothField> smooth_;  // compact_elastic has none
  std::optional<MatrixKernelCells> cells_;

  /// The factorized landmarks, n.
  struct Factorized {
    explicit Factorized(const Options& options);
    std::size_t count = 0;
    std::vector<double> cores;  // mm
    NeedleRings rings;
    NearMatrix near_matrix;
    SymmetricFactor factor;
    BeamColumns beam_columns;
  };
  Factorized factorized_;
  /// What is kept of them while only compliances change, if the options ask.
  struct Kept {
    bool is_asked = false;
    Eigen::MatrixXd matrix;  // K without compliance, unless the factor keeps it
    bool has_matrix = false;
    LandmarkSet::Revision landmarks;  // whose K was assembled last
  };
  Kept kept_;

  /// The field's landmarks, which may be others.
  struct Shown {
    NeedleRings rings;
    std::vector<Vec3> ring_forces;         // near part
    std::vector<NearField::Piece> pieces;  // theirs
  };
  Shown shown_;

  std::vector<std::uint32_t> all_blocks_;
  std::span<const std::uint32_t> touched_;
  std::vector<BlockDisplacement<float>> displacements_;
  std::vector<std::vector<NearSource>> sources_;  // one for each thread
};

}  // namespace brachy
