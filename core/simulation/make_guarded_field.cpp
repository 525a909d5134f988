#include "core/simulation/make_guarded_field.h"

#include <utility>

#include "core/models/blended/blended_kernel_field.h"
#include "core/models/composition.h"
#include "core/models/matrix_kernel/matrix_composition.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/scalar_kernel/scalar_composition.h"
#include "core/models/scalar_kernel/scalar_kernel_field.h"

namespace brachy {
namespace {

/// A model's field, and its sub-steps where it has any.
struct Fields {
  std::unique_ptr<TissueField> field;
  std::unique_ptr<Composition> composition;
};

/// Makes those of each alternative of DeformationModel.
struct FieldMaker {
  const SimulationModel& model;
  BlockField::Options options;
  std::size_t max_substeps;

  Fields operator()(const ScalarModel& scalar) const {
    return {std::make_unique<ScalarKernelField>(model.tissue, scalar.kernel, scalar.support_radius_mm,
                                                options, model.landmark_stiffness_n_per_mm()),
            std::make_unique<ScalarComposition>(model.tissue, scalar.kernel, scalar.support_radius_mm,
                                                options.target, options.max_landmarks, max_substeps)};
  }
  Fields operator()(const MatrixModel& matrix) const {
    const bool composes = model.smooth_tables && model.settings.guard.policy == "substep";
    auto field = std::make_unique<MatrixKernelField>(
        model.tissue, matrix.kernel, model.smooth_tables, matrix.body,
        MatrixKernelField::Options{
            .target = options.target,
            .threads = options.threads,
            .max_landmarks = options.max_landmarks,
            .landmark_stiffness_n_per_mm = model.landmark_stiffness_n_per_mm(),
            .evaluates_points = !composes,
            .keeps_matrix = model.settings.needle.bends() || model.settings.body.gland.moves,
            .budget = model.work_budget()});
    if (!composes) return {std::move(field), nullptr};
    auto composition = std::make_unique<MatrixComposition>(
        model.tissue, *field, options.target, options.max_landmarks, max_substeps, model.work_budget());
    return {std::move(field), std::move(composition)};
  }
  template <class Kernels>
  Fields operator()(const TissueModel<Kernels>& tissues) const {
    return {std::make_unique<BlendedKernelField<Kernels>>(model.tissue, tissues, options,
                                                          model.landmark_stiffness_n_per_mm()),
            nullptr};
  }
};

}  // namespace

std::unique_ptr<GuardedField> make_guarded_field(const SimulationModel& model) {
  const SimulationSettings& s = model.settings;
  const std::size_t landmarks = model.max_landmarks();
  const BlockField::Options options{.target = s.target, .threads = s.threads, .max_landmarks = landmarks};
  Fields fields = std::visit(FieldMaker{model, options, static_cast<std::size_t>(s.guard.max_substeps)},
                             model.deformation);
  return std::make_unique<GuardedField>(model.tissue, std::move(fields.field), std::move(fields.composition),
                                        s.guard, model.work_budget());
}

}  // namespace brachy
