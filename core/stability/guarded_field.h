#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "core/field/tissue_field.h"
#include "core/stability/cell_search.h"
#include "core/stability/certificate.h"
#include "core/stability/composition.h"
#include "core/stability/guard_settings.h"

namespace brachy {

/// A TissueField that knows when it folds: every update is certified (certificate()), and by policy held back or composed
/// of sub-steps before it folds. Sub-steps are for the ψ kernels on homogeneous tissue; the other rungs are held back.
/// Threads: one caller. Real-time: as the field it guards; the certificate's work is bounded by count.
class GuardedField : public TissueField {
 public:
  /// The most work spent on one certificate, in pairs of CellSearch: about 0.2 ms.
  static constexpr std::uint64_t kWork = 8000;

  static constexpr std::uint64_t kTickWork = 4 * kWork;  ///< and on all of a tick

  /// The tissue must outlive this. `composition`: none where the field knows no sub-steps.
  GuardedField(const Tissue& tissue, std::unique_ptr<TissueField> field,
               std::unique_ptr<Composition> composition, const GuardSettings& settings,
               std::size_t max_landmarks);

  FactorStatus place(std::span<const Vec3> positions, std::span<const double> cores = {}) noexcept override {
    return field_->place(positions, cores);
  }
  FactorStatus update(std::span<const Vec3> positions, std::span<const Vec3> displacements,
                      std::span<const double> cores = {}) noexcept override;
  void reactions(std::span<const Vec3> displacements, std::span<Vec3> forces) noexcept override {
    field_->reactions(displacements, forces);
  }
  void axial_stiffness(std::size_t first, std::span<const Vec3> axes,
                       Eigen::Ref<Eigen::MatrixXd> H) noexcept override {
    field_->axial_stiffness(first, axes, H);
  }
  void rescale(double scale) noexcept override { field_->rescale(scale); }
  Evaluation evaluation() const override { return evaluation_; }
  std::span<const std::uint32_t> touched() const override {
    return is_composed_ ? composition_->touched() : field_->touched();
  }
  const BlockDisplacement<float>& displacement(std::uint32_t block) const override {
    return is_composed_ ? composition_->displacement(block) : field_->displacement(block);
  }
  Vec3 displacement_at(const Vec3& X) const noexcept override;
  const CellField& cells() noexcept override { return field_->cells(); }
  std::size_t max_sources() const override { return field_->max_sources(); }
  double condition() const override { return field_->condition(); }
  double total_force_n() const override { return field_->total_force_n(); }
  SimdTarget target() const override { return field_->target(); }

  const Certificate& certificate() const { return certificate_; }
  std::uint32_t flags() const { return flags_; }  ///< StepFlag bits of what acted

 private:
  void guard() noexcept;
  void hold_back(const CellField& cells, const Suspect& suspect) noexcept;
  void compose() noexcept;
  CellSearch::Result search(const CellField& cells, double scale, const Suspect& suspect,
                            std::uint64_t most = kWork) noexcept;
  CellSearch::Result find_step(const CellField& cells, const Suspect& suspect, double& scale) noexcept;
  void take(const CellSearch::Result& result) noexcept;
  void find_margin(const CellField& cells, double scale, const Suspect& suspect) noexcept;
  void find_least_vertex(const CellField& cells, double scale = 1) noexcept;
  double largest_displacement() const noexcept;
  bool is_flagged_only() const { return settings_.policy == "flag"; }
  bool may_compose() const { return settings_.policy == "substep" && composition_; }

  const Tissue& tissue_;
  std::unique_ptr<TissueField> field_;
  std::unique_ptr<Composition> composition_;
  GuardSettings settings_;
  CellSearch search_;

  std::vector<Vec3> positions_, displacements_;
  std::vector<double> cores_;
  bool is_updated_ = false;  // the field is that of these landmarks
  bool is_composed_ = false;
  std::uint64_t work_left_ = 0;  // of this tick
  Evaluation evaluation_ = Evaluation::kIdle;
  Certificate certificate_;
  Vec3 least_vertex_ = Vec3::Zero();  // rest position of that of certificate_.vertex_det
  std::uint32_t flags_ = 0;
  std::vector<std::uint32_t> all_, near_;  // sources
  std::vector<std::pair<double, std::uint32_t>> block_bounds_;
};

}  // namespace brachy
