#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/elasticity/elastic_body.h"
#include "core/kernels/matrix_kernel.h"

namespace brachy {

// The deformation models (core/DESIGN.md, section 3), cheapest first: the scalar kernels of core/kernels, then the
// matrix-valued kernels of elasticity. A scene's `[model] kernel` and `brachy deform --kernel` name one.

/// All models: those of for_each_kernel, then the list in matrix_models.cpp.
std::vector<std::string> all_model_names();

/// Whether `model_name` is in the list of matrix-valued kernels.
bool is_matrix_model(std::string_view model_name);

/// Whether it is a matrix-valued kernel of compact support (compact_kernel.h): it knows no walls and no width
/// of a needle.
bool is_compact_model(std::string_view model_name);

/// Whether its landmarks' forces are newtons: `elastic` and `fem`.
inline bool knows_forces(std::string_view model_name) {
  return is_matrix_model(model_name) && !is_compact_model(model_name);
}

/// What to say of a model that earlier versions had: why it is refused and what to take instead. Empty for all others.
std::string_view retired_model_advice(std::string_view model_name);

/// The kernel of matrix model `model_name` for a body; finite elements are made for tables (SmoothTables) of `points`,
/// which bound the tissue (none: the middle half of the box). `elastic` and `fem` take some tenths of a second.
/// Errors: UserError where the model cannot have the body.
std::unique_ptr<MatrixKernel> make_matrix_kernel(std::string_view model_name, const ElasticBody& body,
                                                 std::span<const Vec3> points = {});

}  // namespace brachy
