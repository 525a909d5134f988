#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/models/blended/blended_kernel_cells.h"
#include "core/models/blended/blended_kernel_system.h"
#include "core/models/blended/compact_blocks.h"
#include "core/models/blended/tissue_part.h"
#include "core/models/blocks/block_field.h"
#include "core/models/tissue_field.h"

namespace brachy {

/// A tick in tissues of different supports: landmarks → BlendedKernelSystem → u(X) = Σ_m w_m(X) u_m(X), where each
/// u_m is summed by the loops of its kernel over the landmarks and the blocks of which tissue m has a share, and
/// w_m at the points is known since construction. Always summed directly: columns are not condensed.
/// The field agrees with HeterogeneousField's to 2e-5 mm.
/// Threads: one caller (OpenMP inside, if the options ask). Real-time: with one thread update does not allocate,
/// lock or throw.
template <class Kernels>
class BlendedKernelField : public TissueField {
 public:
  /// The tissue must outlive this. Of `options`: target, threads and max_landmarks. `landmark_stiffness`, N/mm: of one
  /// landmark alone in tissue 0, the base; 0: what the kernel itself has there (the ψ kernels 1). Displacements do not
  /// depend on it.
  BlendedKernelField(const Tissue& tissue, TissueModel<Kernels> model, const BlockField::Options& options,
                     double landmark_stiffness_n_per_mm = 0);

  std::span<const std::uint32_t> touched() const override { return touched_; }
  const BlockDisplacement<float>& displacement(std::uint32_t block) const override {
    return displacements_[block];
  }
  Vec3 displacement_at(const Vec3& X) const noexcept override { return field().displacement(X); }
  const CellField& cells() noexcept override {
    cells_.set_field(field());
    return cells_;
  }
  std::size_t max_sources() const override { return max_landmarks(); }

  /// The last update's field at single points, in double.
  HeterogeneousField<Kernels> field() const { return {&model_, positions(), shares_, weights()}; }

 private:
  FactorStatus do_factorize(const LandmarkSet& landmarks, double& condition) noexcept override;
  void do_solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept override;
  void do_project_inverse(std::size_t first, std::span<const Vec3> axes,
                          Eigen::Ref<Eigen::MatrixXd> H) noexcept override;
  Evaluation do_evaluate(bool is_new_set, std::span<Vec3> weights) noexcept override;
  void do_rescale(double scale) noexcept override;

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
  void evaluate_parts(std::span<const Vec3> weights) noexcept;
  void add(const Part& part) noexcept;

  TissueModel<Kernels> model_;
  BlendedKernelSystem<Kernels> system_;
  BlendedKernelCells<Kernels> cells_;
  std::vector<std::unique_ptr<Part>> parts_;

  std::vector<double> shares_;  // of the field's landmarks

  std::vector<std::uint32_t> touched_;
  std::vector<bool> is_touched_;
  std::vector<BlockDisplacement<float>> displacements_;
};

extern template class BlendedKernelField<ScalarKernels>;
extern template class BlendedKernelField<CompactKernels>;

}  // namespace brachy
