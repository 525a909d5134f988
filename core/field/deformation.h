#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/field/block_field.h"
#include "core/field/tissue_field.h"
#include "core/rbf/rbf_field.h"
#include "core/rbf/rbf_system.h"
#include "core/stability/scalar_cells.h"

namespace brachy {

/// The scalar kernels' way from landmarks to displaced points: the landmark system and the field of one kernel, evaluated by the cheaper way.
///
/// When the landmarks' rest positions have stayed put for kSettleTicks, the columns of K⁻¹ that belong to moving
/// landmarks are computed, three a tick, then the blocks' condensed columns, each tick no more than a direct
/// evaluation's worth; so no tick costs more than about two direct ones. A new set of landmarks, or another one of
/// them moving, starts over with direct evaluation. What is chosen depends on counts only, never on measured time: the
/// same landmarks give the same bits. The two ways differ by less than 2e-5 mm.
/// Threads: one caller. Real-time: no allocation after construction with one thread, no exceptions.
class Deformation : public TissueField {
 public:
  static constexpr int kSettleTicks = 4;

  /// `support_radius` a in mm; the tissue must outlive this. `landmark_stiffness`, N/mm: of one landmark alone, which is
  /// what makes forces of the weights; displacements do not depend on it.
  Deformation(const Tissue& tissue, Kernel kernel, double support_radius, const BlockField::Options& options,
              double landmark_stiffness_n_per_mm = 1);

  FactorStatus place(std::span<const Vec3> positions, std::span<const double> cores = {}) noexcept override;
  FactorStatus update(std::span<const Vec3> positions, std::span<const Vec3> displacements,
                      std::span<const double> cores = {}) noexcept override;
  void reactions(std::span<const Vec3> displacements, std::span<Vec3> forces) noexcept override;
  void axial_stiffness(std::size_t first, std::span<const Vec3> axes,
                       Eigen::Ref<Eigen::MatrixXd> H) noexcept override;

  void rescale(double scale) noexcept override;
  Evaluation evaluation() const override { return evaluation_; }
  double condition() const override { return condition_; }
  std::span<const std::uint32_t> touched() const override { return blocks_.touched(); }
  const BlockDisplacement<float>& displacement(std::uint32_t block) const override {
    return blocks_.displacement(block);
  }
  Vec3 displacement_at(const Vec3& X) const noexcept override { return field_.displacement(X); }
  const CellField& cells() noexcept override {
    cells_.set_field(field_);
    return cells_;
  }
  std::size_t max_sources() const override { return positions_.capacity(); }
  double total_force_n() const override;
  SimdTarget target() const override { return blocks_.target(); }
  const BlockField& blocks() const { return blocks_; }  ///< displacements of the points in reach
  const RbfField& field() const { return field_; }      ///< the same field at single points, in double

 private:
  void choose_moving() noexcept;
  bool is_condensable() const noexcept;
  bool moves_within_columns() const noexcept;
  void restart() noexcept;
  void advance_condensing() noexcept;
  void compute_weights() noexcept;

  double landmark_stiffness_;  // ψ(0) = 1: of weights of 1 mm
  RbfSystem system_;
  InverseBlock inverse_block_;
  BlockField blocks_;
  RbfField field_;
  ScalarCells cells_;
  Evaluation evaluation_ = Evaluation::kIdle;

  bool is_factored_ = false;  // system_ holds placed_
  double condition_ = 1;
  std::vector<Vec3> placed_;
  bool has_field_ = false;
  std::vector<Vec3> positions_, displacements_, weights_;  // of the field
  int settled_ticks_ = 0;

  // condensing: the moving landmarks, their columns of K⁻¹ (n × m by rows), and how far it has got
  std::vector<std::uint32_t> moving_;
  std::vector<double> inverse_columns_;
  std::size_t columns_done_ = 0;
  bool is_condensing_ = false;  // moving_ is chosen
  bool has_columns_ = false;    // inverse_columns_ is complete
  bool is_complete_ = false;    // every block is condensed
  std::vector<Vec3> moving_displacements_;
};

}  // namespace brachy
