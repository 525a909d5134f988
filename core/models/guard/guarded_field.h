#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "core/base/work_budget.h"
#include "core/injectivity/certificate.h"
#include "core/injectivity/guard_settings.h"
#include "core/injectivity/injectivity_search.h"
#include "core/models/composition.h"
#include "core/models/tissue_field.h"

namespace brachy {

/// A displacement field that is certified at every update (certificate()) and, by policy, clamped or composed of
/// sub-steps before it folds. Sub-steps are for the ψ kernels on homogeneous tissue; the other models are clamped.
/// Threads: one caller. Real-time: as the field it guards; the certificate's work is bounded by count.
class GuardedField : public DisplacementField {
 public:
  /// The tissue must outlive this. `composition`: null where the model has no sub-steps. `budget`: what a tick may
  /// search for folds.
  GuardedField(const Tissue& tissue, std::unique_ptr<TissueField> field,
               std::unique_ptr<Composition> composition, const GuardSettings& settings,
               const WorkBudget& budget = {});

  /// Certifies and evaluates the field of `landmarks`, which are settled, as TissueField::update. Unless it returns
  /// kOk, the last field is kept.
  FactorStatus update(const LandmarkSet& landmarks) noexcept;
  /// Whether every field is composed of sub-steps: then update takes most of a tick where landmarks are many.
  bool always_composes() const { return may_compose() && composition_->is_always_used(); }
  /// Whether update would find the field as it is: of landmarks with the same numbers, so none of them farther than
  /// LandmarkSet::kRestToleranceMm from where the field has it.
  bool shows(const LandmarkSet& landmarks) const noexcept { return landmarks.revision() == shown_; }
  Evaluation evaluation() const { return evaluation_; }  ///< of the last update

  std::span<const std::uint32_t> touched() const override {
    return is_composed_ ? composition_->touched() : field_->touched();
  }
  const BlockDisplacement<float>& displacement(std::uint32_t block) const override {
    return is_composed_ ? composition_->displacement(block) : field_->displacement(block);
  }
  Vec3 displacement_at(const Vec3& X) const noexcept override;
  void displacements_at(std::span<const Vec3> X, std::span<Vec3> u) noexcept override;

  /// The field without the guard: for the landmarks' system, its solutions and its condition.
  TissueField& plain_field() { return *field_; }
  const TissueField& plain_field() const { return *field_; }

  /// As Composition::lag_mm, of the last update.
  double lag_mm() const { return is_composed_ ? composition_->lag_mm() : 0; }
  /// Of what is shown. A vertex may decide what the search could not; and where blocks lag behind an injective field
  /// they are none of it, and the verdict is unknown.
  Certificate certificate() const;
  std::uint32_t flags() const;  ///< StepFlag bits of the guard in this tick

  /// What the field has besides `landmarks`, the last settled ones: above all what it still shows of earlier ones. A
  /// field that is made alike and restored with the same landmarks goes on bit for bit. Errors: as StateReader; restore
  /// is not real-time.
  void save(StateWriter& writer, const LandmarkSet::Revision& landmarks) const;
  void restore(StateReader& reader, const LandmarkSet& landmarks);

 private:
  void guard() noexcept;
  void clamp(const CellField& cells, const FoldCandidate& fold_candidate) noexcept;
  void compose() noexcept;
  void evaluate_composition() noexcept;
  void go_on_certifying() noexcept;
  const InjectivitySearch::Result& search(InjectivitySearch& search, const CellField& cells, double scale,
                                          const FoldCandidate& fold_candidate, std::uint64_t pairs) noexcept;
  const InjectivitySearch::Result& find_step(InjectivitySearch& search, const CellField& cells,
                                             const FoldCandidate& fold_candidate, double& scale) noexcept;
  void expect_steps(double scale) noexcept;
  Allowance allowance(const CellField& cells) const noexcept;
  void add_to_certificate(const InjectivitySearch::Result& result) noexcept;
  void find_margin(const CellField& cells, double scale, const FoldCandidate& fold_candidate) noexcept;
  void find_least_vertex(const CellField& cells, double scale = 1) noexcept;
  double largest_displacement() const noexcept;
  bool is_flagged_only() const { return settings_.policy == "flag"; }
  bool may_compose() const { return settings_.policy == "substep" && composition_; }

  const Tissue& tissue_;
  std::unique_ptr<TissueField> field_;
  std::unique_ptr<Composition> composition_;
  GuardSettings settings_;
  WorkBudget budget_;
  InjectivitySearch search_;  // of whole fields, for candidates and the margin
  /// Of what is composed, in this tick.
  struct Parts {
    std::vector<InjectivitySearch> searches;  // one for all where fields are not kept
    std::size_t count = 0;                    // of parts
    std::size_t steps = 0;                    // of the way, that are expected
    std::size_t blocks = 0;                   // that were expected to be evaluated after it
    double begun = 1;                         // bound of the determinant of what has none
    std::uint64_t spent_pairs = 0;            // by all searches
  };
  Parts parts_;

  LandmarkSet::Revision shown_;  // of the landmarks that the field is of; without numbers: of none
  bool is_composed_ = false;
  Evaluation evaluation_ = Evaluation::kIdle;
  Certificate certificate_;
  Vec3 least_vertex_ = Vec3::Zero();  // rest position of that of certificate_.vertex_det
  std::uint32_t flags_ = 0;
  struct Sources {
    std::vector<std::uint32_t> all, near;
  };
  Sources sources_;
  std::vector<std::pair<double, std::uint32_t>> block_bounds_;
};

}  // namespace brachy
