#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/compact/compact_kernel.h"
#include "core/elastic/elastic_body.h"
#include "core/kernels/matrix_kernel.h"

namespace brachy {

// The model ladder (DESIGN §3), cheapest rung first: the scalar kernels of core/kernels, then those that know
// elasticity. A scene's `[model] kernel` and `brachy deform --kernel` name one.

/// All rungs: "psi31", …, "multiscale", "compact_elastic", "elastic", "fem".
std::vector<std::string> rung_names();

/// Whether `rung` is one of the matrix-valued kernels (multiscale and up).
bool is_matrix_rung(std::string_view rung);

/// Which of the two compact matrix rungs `rung` is, or nothing.
std::optional<CompactRung> find_compact_rung(std::string_view rung);

/// The kernel of matrix rung `rung` for a body. `elastic` and `fem` take some tenths of a second to some seconds.
/// Errors: UserError where the rung cannot have the body (elastic: more than one region).
std::unique_ptr<MatrixKernel> make_matrix_kernel(std::string_view rung, const ElasticBody& body);

}  // namespace brachy
