#pragma once

#include <cstdint>
#include <span>

#include "core/injectivity/certificate.h"
#include "core/models/displacement_field.h"

namespace brachy {

/// Whether a position has a material point, and whether it is the only one.
enum class Inversion : std::uint8_t {
  kFound,
  kFolded,        ///< none but one in a fold of the field, where it is turned inside out
  kAmbiguous,     ///< found, but the searches found others too, or the field folds somewhere
  kNotConverged,  ///< not within kInversionTolerance in kInversionSteps
};

inline constexpr double kInversionTolerance = 1e-6;  ///< mm, of X + u(X) from the position
inline constexpr int kInversionSteps = 40;

struct MaterialPoint {
  Inversion result = Inversion::kNotConverged;
  Vec3 X = Vec3::Zero();      ///< mm, where it is at rest
  Mat3 F = Mat3::Identity();  ///< I + ∇u there
};

/// The material point X of a position x in the deformed tissue, X + u(X) = x (core/DESIGN.md, section 6), by
/// Newton's method with step halving, the gradient of u by central differences, starting at `guess`, the needle's
/// tip in the rest shape. In a field certified injective there is exactly one. Otherwise searches also start at x and
/// at x − u(x): where they find different points, the first search's is taken, the tissue that the needle has cut to.
/// Threads: the field's. Real-time: no allocation; at most some 2,000 evaluations of u, two dozen usually.
MaterialPoint find_material_point(const DisplacementField& field, Verdict verdict, const Vec3& x,
                                  const Vec3& guess) noexcept;

/// The material points of many positions at once, quickly, into `X` (as many): by X ← x − u(X), which converges where
/// strains are below 1, with displacements_at, so to some 0.001 mm; those that do not come to rest, by
/// find_material_point. One that has none is where its position is. In a field that is not certified another may be as
/// good. Threads: the field's, which is used as displacements_at says. Not real-time: allocates.
void find_material_points(DisplacementField& field, Verdict verdict, std::span<const Vec3> x,
                          std::span<Vec3> X);

}  // namespace brachy
