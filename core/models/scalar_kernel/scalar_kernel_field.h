#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/injectivity/scalar_cells.h"
#include "core/models/blocks/block_field.h"
#include "core/models/tissue_field.h"
#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"

namespace brachy {

/// The deformation model of one scalar kernel: landmark system and field, evaluated in the cheaper of two ways.
///
/// When the landmarks' rest positions have not changed for some ticks (SpeedThresholds), the columns of K⁻¹ that belong
/// to moving landmarks are computed, three a tick, then the blocks' condensed columns, each tick no more than a direct
/// evaluation's worth; so no tick costs more than about two direct ones. A new set of landmarks, or another
/// moving landmark, starts again with direct evaluation. What is chosen depends on counts only, never on measured
/// time: the same landmarks give the same bits. The two ways differ by less than 2e-5 mm.
/// Threads: one caller. Real-time: no allocation after construction with one thread, no exceptions.
class ScalarKernelField : public TissueField {
 public:
  /// `support_radius` a in mm; the tissue must outlive this. `landmark_stiffness`, N/mm: of one landmark alone;
  /// it scales the weights to forces. Displacements do not depend on it.
  ScalarKernelField(const Tissue& tissue, Kernel kernel, double support_radius,
                    const BlockField::Options& options, double landmark_stiffness_n_per_mm = 1);

  std::span<const std::uint32_t> touched() const override { return blocks_.touched(); }
  const BlockDisplacement<float>& displacement(std::uint32_t block) const override {
    return blocks_.displacement(block);
  }
  Vec3 displacement_at(const Vec3& X) const noexcept override { return field_.displacement(X); }
  const CellField& cells() noexcept override {
    cells_.set_field(field_);
    return cells_;
  }
  std::size_t max_sources() const override { return max_landmarks(); }
  const BlockField& blocks() const { return blocks_; }  ///< displacements of the points in reach
  const RbfField& field() const { return field_; }      ///< the same field at single points, in double

 private:
  FactorStatus do_factorize(const LandmarkSet& landmarks, double& condition) noexcept override;
  void do_solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept override;
  void do_project_inverse(std::size_t first, std::span<const Vec3> axes,
                          Eigen::Ref<Eigen::MatrixXd> H) noexcept override;
  Evaluation do_evaluate(bool is_new_set, std::span<Vec3> weights) noexcept override;
  void do_rescale(double scale) noexcept override;
  void do_save(StateWriter& writer) const override;
  void do_restore(StateReader& reader) override;

  void choose_moving() noexcept;
  bool is_condensable() const noexcept;
  bool moves_within_columns() const noexcept;
  void restart() noexcept;
  void advance_condensing() noexcept;
  void add_columns() noexcept;
  void condense_share() noexcept;
  void compute_weights(std::span<Vec3> weights) noexcept;

  RbfSystem system_;
  InverseBlock inverse_block_;
  BlockField blocks_;
  RbfField field_;
  ScalarCells cells_;

  int settled_ticks_ = 0;

  // condensing: the moving landmarks, their columns of K⁻¹ (n × m by rows), and how far it has got
  std::vector<std::uint32_t> moving_;
  std::vector<double> inverse_columns_;
  std::size_t columns_done_ = 0;
  bool is_condensing_ = false;  // moving_ is chosen
  bool has_columns_ = false;    // inverse_columns_ is complete
  bool is_complete_ = false;    // every block is condensed
  std::uint64_t shares_ = 0;    // of the blocks' condensing that are done
  std::vector<Vec3> moving_displacements_;
};

}  // namespace brachy
