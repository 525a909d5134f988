#pragma once

#include <cstdint>

#include "core/field/tissue_field.h"
#include "core/stability/certificate.h"

namespace brachy {

/// Why a place has no material point, or that it has.
enum class Inversion : std::uint8_t {
  kFound,
  kFolded,        ///< the field folds: the place may have several
  kAmbiguous,     ///< nobody knows whether the field folds, and not all searches came to one point
  kNotConverged,  ///< not within kInversionTolerance in kInversionSteps
};

inline constexpr double kInversionTolerance = 1e-6;  ///< mm, of X + u(X) from the place
inline constexpr int kInversionSteps = 40;

struct MaterialPoint {
  Inversion result = Inversion::kNotConverged;
  Vec3 X = Vec3::Zero();      ///< mm, where it is at rest
  Mat3 F = Mat3::Identity();  ///< I + ∇u there
};

/// The material point X of a place x of the deformed tissue, X + u(X) = x (DESIGN §6), by Newton's method with halved steps;
/// u as the field shows it, its gradient by central differences; from `guess`, where the needle's tip is in the rest shape. In
/// a field certified injective there is one only; where the verdict is unknown it is looked for from x as well, and taken
/// if all searches come to the same one.
/// Threads: the field's. Real-time: no allocation; at most some 2,000 evaluations of u, two dozen as a rule.
MaterialPoint find_material_point(const TissueField& field, Verdict verdict, const Vec3& x,
                                  const Vec3& guess) noexcept;

}  // namespace brachy
