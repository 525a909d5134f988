#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/field/block_field.h"
#include "core/field/tissue_field.h"
#include "core/heterogeneous/compact_blocks.h"
#include "core/heterogeneous/heterogeneous_cells.h"
#include "core/heterogeneous/heterogeneous_system.h"
#include "core/heterogeneous/tissue_part.h"

namespace brachy {

/// A tick in tissues of different supports: landmarks → HeterogeneousSystem → u(X) = Σ_m w_m(X) u_m(X), where each u_m is
/// summed by the loops of its one kernel over the landmarks and the blocks of which tissue m has a share, and w_m at the
/// points is known since construction. Always summed directly: columns are not condensed.
/// The field agrees with HeterogeneousField's to 2e-5 mm.
/// Threads: one caller (OpenMP inside, if the options ask). Real-time: with one thread update does not allocate, lock or
/// throw.
template <class Kernels>
class HeterogeneousDeformation : public TissueField {
 public:
  /// The tissue must outlive this. Of `options`: target, threads and max_landmarks. `landmark_stiffness`, N/mm: of one
  /// landmark alone in tissue 0, the base; 0: what the kernel itself has there (the ψ kernels 1). Displacements do not
  /// depend on it.
  HeterogeneousDeformation(const Tissue& tissue, TissueModel<Kernels> model,
                           const BlockField::Options& options, double landmark_stiffness_n_per_mm = 0);

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
  Vec3 displacement_at(const Vec3& X) const noexcept override { return field().displacement(X); }
  const CellField& cells() noexcept override {
    cells_.set_field(field());
    return cells_;
  }
  std::size_t max_sources() const override { return options_.max_landmarks; }
  double total_force_n() const override;
  SimdTarget target() const override { return options_.target; }

  /// The last update's field at single points, in double.
  HeterogeneousField<Kernels> field() const { return {&model_, positions_, shares_, weights_}; }

 private:
  using Blocks = std::conditional_t<Kernels::kRows == 1, BlockField, CompactBlocks>;
  /// One tissue: its points and the landmarks that have a share of it.
  struct Part {
    Part(TissuePart points, const Kernels& kernels, std::size_t tissue, const BlockField::Options& options);
    TissuePart where;
    Blocks blocks;  // refers to where.points
    std::vector<std::uint32_t> landmarks;
    std::vector<Vec3> positions, weights;
  };

  void share_out_landmarks() noexcept;
  void evaluate() noexcept;
  void add(const Part& part) noexcept;

  TissueModel<Kernels> model_;
  BlockField::Options options_;
  HeterogeneousSystem<Kernels> system_;
  HeterogeneousCells<Kernels> cells_;
  std::vector<std::unique_ptr<Part>> parts_;

  double force_scale_;        // N for a weight of 1
  bool is_factored_ = false;  // system_ holds placed_
  std::vector<Vec3> placed_;
  bool has_field_ = false;
  std::vector<Vec3> positions_, displacements_wanted_, weights_;  // of the field
  std::vector<double> shares_;
  double condition_ = 1;
  Evaluation evaluation_ = Evaluation::kIdle;

  std::vector<std::uint32_t> touched_;
  std::vector<bool> is_touched_;
  std::vector<BlockDisplacement<float>> displacements_;
};

extern template class HeterogeneousDeformation<ScalarKernels>;
extern template class HeterogeneousDeformation<CompactKernels>;

}  // namespace brachy
