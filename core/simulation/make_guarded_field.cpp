#include "core/simulation/make_guarded_field.h"

#include <utility>

#include "core/models/blended/blended_kernel_field.h"
#include "core/models/guard/composition.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/scalar_kernel/scalar_kernel_field.h"

namespace brachy {
namespace {

/// Makes the field of each alternative of DeformationModel.
struct FieldMaker {
  const SimulationModel& model;
  BlockField::Options options;

  std::unique_ptr<TissueField> operator()(const ScalarModel& scalar) const {
    return std::make_unique<ScalarKernelField>(model.tissue, scalar.kernel, scalar.support_radius_mm, options,
                                               model.landmark_stiffness_n_per_mm());
  }
  std::unique_ptr<TissueField> operator()(const MatrixModel& matrix) const {
    return std::make_unique<MatrixKernelField>(
        model.tissue, matrix.kernel, model.smooth_tables, matrix.body,
        MatrixKernelField::Options{.target = options.target,
                                   .threads = options.threads,
                                   .max_landmarks = options.max_landmarks,
                                   .landmark_stiffness_n_per_mm = model.landmark_stiffness_n_per_mm()});
  }
  template <class Kernels>
  std::unique_ptr<TissueField> operator()(const TissueModel<Kernels>& tissues) const {
    return std::make_unique<BlendedKernelField<Kernels>>(model.tissue, tissues, options,
                                                         model.landmark_stiffness_n_per_mm());
  }
};

}  // namespace

std::unique_ptr<GuardedField> make_guarded_field(const SimulationModel& model) {
  const SimulationSettings& s = model.settings;
  const std::size_t landmarks = model.max_landmarks();
  const BlockField::Options options{.target = s.target, .threads = s.threads, .max_landmarks = landmarks};
  std::unique_ptr<TissueField> field = std::visit(FieldMaker{model, options}, model.deformation);
  std::unique_ptr<Composition> composition;
  if (const auto* scalar = std::get_if<ScalarModel>(&model.deformation))
    composition =
        std::make_unique<Composition>(model.tissue, scalar->kernel, scalar->support_radius_mm, s.target,
                                      landmarks, static_cast<std::size_t>(s.guard.max_substeps));
  return std::make_unique<GuardedField>(model.tissue, std::move(field), std::move(composition), s.guard,
                                        landmarks);
}

}  // namespace brachy
