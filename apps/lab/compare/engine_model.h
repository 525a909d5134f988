#pragma once

#include <functional>
#include <memory>

#include "apps/lab/comparators/compared_model.h"
#include "core/geometry/tissue/tissue.h"
#include "core/kernels/kernels.h"
#include "core/models/tissue_field.h"

namespace brachy {

/// What a tick may omit.
struct Sparing {
  std::size_t every = 1;   ///< landmarks: the first, every so many after it, and the last
  std::size_t points = 0;  ///< the first so many of the scene's; 0: all
};

/// A model as the daemon runs it: a TissueField on a tissue of the scene's points, one thread.
class EngineModel : public ComparedModel {
 public:
  /// A ψ model. `support_radius` in mm; `has_anchors`: with the paper's eight (paper_anchors), which do not move.
  static std::unique_ptr<EngineModel> psi(Kernel kernel, double support_radius, bool has_anchors,
                                          Sparing sparing = {});
  /// A matrix model of all_model_names().
  static std::unique_ptr<EngineModel> matrix(const std::string& model_name, Sparing sparing = {});

  void set_up(const ComparedScene& scene) override;
  void tick(std::span<const Vec3> displacements) override;
  bool move(std::span<const Vec3> landmarks) override;
  void read(std::span<Vec3> u) const override;
  std::vector<Vec3> displacements_at(std::span<const Vec3> X) const override;
  bool is_warm() const override { return !condenses_ || field_->evaluation() == Evaluation::kCondensed; }

 private:
  using MakeField =
      std::function<std::unique_ptr<TissueField>(const Tissue&, const ElasticBody&, std::size_t landmarks)>;
  EngineModel(MakeField make_field, bool has_anchors, bool condenses, Sparing sparing)
      : make_field_(std::move(make_field)),
        has_anchors_(has_anchors),
        condenses_(condenses),
        sparing_(sparing) {}

  MakeField make_field_;
  bool has_anchors_;
  bool condenses_;  // later ticks on the same landmarks are cheaper
  Sparing sparing_;
  std::vector<std::size_t> kept_;  // of the scene's landmarks
  Tissue tissue_;
  std::vector<std::uint32_t> order_;  // of the tissue's points in the scene's
  std::unique_ptr<TissueField> field_;
  LandmarkSet landmarks_;  // and anchors
};

}  // namespace brachy
