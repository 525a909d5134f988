#pragma once

#include <vector>

#include "core/injectivity/cell_field.h"
#include "core/models/blended/blended_kernel_system.h"
#include "core/models/blended/reach_bounds.h"
#include "core/models/matrix_kernel/near_loops.h"

namespace brachy {

/// u at a cell's points, mm.
struct CellDisplacements {
  alignas(64) float u[3][CellPoints::kCount];
};

/// The field of tissues of different supports, for the certificate: ∇u = Σ_m [w_m ∇u_m + u_m ∇w_mᵀ], and of a product's
/// derivatives up to the third bounds by Leibniz' rule. Its domain is everything within the supports.
template <class Kernels>
class BlendedKernelCells : public CellField {
 public:
  /// The model must outlive this.
  BlendedKernelCells(const TissueModel<Kernels>& model, SimdTarget target, std::size_t max_landmarks);

  /// Sets the field, one of that model.
  void set_field(const HeterogeneousField<Kernels>& field) noexcept;

  std::size_t sources() const override { return field_.positions.size(); }
  Cell domain() const override { return domain_; }
  double resolution() const override { return resolution_; }
  std::size_t narrow(const Cell& cell, std::span<const std::uint32_t> from, std::uint32_t* to,
                     CellBounds& bounds) const noexcept override;
  void gradients(const Cell& cell, std::span<const std::uint32_t> sources, const CellBounds& bounds,
                 const CellPoints& X, CellGradients& A) const noexcept override;
  const CellLoops& loops() const override { return loops_; }
  bool fold_candidates(std::uint32_t i, Cell& cell, CellPoints& X) const noexcept override;
  Mat3 gradient(const Vec3& X) const noexcept override {
    return field_.deformation_gradient(X) - Mat3::Identity();
  }

 private:
  using Shares = std::array<Membership::ShareBounds, Membership::kMaxTissues>;
  /// Of the cell: what Σ_i |f_i| C says of u_m's derivatives, [j] the j-th, and what u_m and ∇u_m can be.
  struct Sums {
    std::array<double, 4> norms{};
    double value = 0, slope = 0;
  };
  double share(std::size_t i, std::size_t m) const { return field_.shares[i * reach_.size() + m]; }
  /// Of `from` into `to`, those whose support reaches the cell, with their distances_; returns how many.
  std::size_t find_near(const Cell& cell, std::span<const std::uint32_t> from,
                        std::uint32_t* to) const noexcept;
  static void add_tissue(const Membership::ShareBounds& w, const Sums& of, CellBounds& bounds) noexcept;
  Shares bound_shares(const Cell& cell) const noexcept;
  void evaluate_centre(std::size_t m, const Cell& cell, std::span<const std::uint32_t> sources,
                       std::int32_t left_out, Sums& sums) const noexcept;
  /// ∇u_m and, if it is asked for, u_m by `sources` but `left_out`.
  void sum(std::size_t m, const Cell& cell, std::span<const std::uint32_t> sources, std::int32_t left_out,
           const CellPoints& X, CellGradients& A, CellDisplacements* u) const noexcept;

  const TissueModel<Kernels>& model_;
  HeterogeneousField<Kernels> field_;
  const CellLoops& loops_;
  const NearLoops& near_loops_;
  ScalarGradients scalar_gradients_ = nullptr;  // of a ψ kernel …
  std::vector<CompactShape> shapes_;            // … or of compact ones
  std::vector<ReachBounds> reach_;
  double resolution_;
  Cell domain_;
  std::vector<double> sizes_;  // |weight| of each landmark
  mutable std::vector<double> distances_;
  mutable std::vector<CellSource> chosen_;  // of the cell in work
  mutable std::vector<NearSource> chosen_near_;
};

template <>
void BlendedKernelCells<ScalarKernels>::sum(std::size_t, const Cell&, std::span<const std::uint32_t>,
                                            std::int32_t, const CellPoints&, CellGradients&,
                                            CellDisplacements*) const noexcept;
template <>
void BlendedKernelCells<CompactKernels>::sum(std::size_t, const Cell&, std::span<const std::uint32_t>,
                                             std::int32_t, const CellPoints&, CellGradients&,
                                             CellDisplacements*) const noexcept;
extern template class BlendedKernelCells<ScalarKernels>;
extern template class BlendedKernelCells<CompactKernels>;

}  // namespace brachy
