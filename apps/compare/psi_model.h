#pragma once

#include <memory>

#include "apps/comparators/compared_model.h"
#include "core/field/deformation.h"

namespace brachy {

/// A ψ rung as the daemon runs it: core's Deformation on a tissue of the scene's points, one thread.
class PsiModel : public ComparedModel {
 public:
  /// `support_radius` in mm; `has_anchors`: the paper's eight (paper_anchors), which do not move.
  PsiModel(Kernel kernel, double support_radius, bool has_anchors)
      : kernel_(kernel), support_radius_(support_radius), has_anchors_(has_anchors) {}

  void set_up(const ComparedScene& scene) override;
  void tick(std::span<const Vec3> displacements) override;
  void read(std::span<Vec3> u) const override;
  std::vector<Vec3> displacements_at(std::span<const Vec3> X) const override;
  std::vector<double> jacobians(std::span<const Vec3> X) const override;
  bool is_warm() const override { return deformation_->evaluation() == Evaluation::kCondensed; }

 private:
  Kernel kernel_;
  double support_radius_;
  bool has_anchors_;
  Tissue tissue_;
  std::vector<std::uint32_t> order_;  // of the tissue's points in the scene's
  std::unique_ptr<Deformation> deformation_;
  std::vector<Vec3> positions_, displacements_;  // landmarks, anchors
};

}  // namespace brachy
