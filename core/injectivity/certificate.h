#pragma once

#include <cstdint>
#include <limits>
#include <string_view>

#include "core/base/rigid_transform.h"

namespace brachy {

/// Whether a displacement field is injective over the continuum, not only at vertices. Sent over the wire: append only.
enum class Verdict : std::uint8_t {
  kUnknown = 0,    ///< neither could be shown within the work limit of a tick
  kInjective = 1,  ///< det(I + ∇u) > 0 everywhere: no two points of the tissue meet
  kFolded = 2,     ///< det(I + ∇u) ≤ 0 at `place`
};

constexpr std::string_view to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::kInjective:
      return "injective";
    case Verdict::kFolded:
      return "folded";
    case Verdict::kUnknown:
      break;
  }
  return "unknown";
}

/// A tick's field, certified: part of every MeshState and FRAME. The defaults are those of the tissue at rest.
struct Certificate {
  static constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

  Verdict verdict = Verdict::kInjective;
  /// Lower bound of det(I + ∇u) over the continuum; of composed sub-steps, the product of theirs. NaN unless injective.
  double det_bound = 1;
  double vertex_det = 1;      ///< the least det(I + ∇u) at the tissue's vertices
  Vec3 place = Vec3::Zero();  ///< rest position of the fold, or else of the least det found, mm, world frame
  /// The landmark displaced most can move at least this much further in its direction; NaN: none is displaced.
  double margin_mm = kNotKnown;
  std::uint32_t substeps = 0;  ///< fields composed: 0 at rest, 1 the plain field
  /// Clamped: the largest part of a landmark's displacement that was not applied.
  double held_mm = 0;
  /// The force of that part, N; NaN: nothing is clamped, or sub-steps were composed.
  double held_n = kNotKnown;
  double condition = 1;  ///< estimated condition number of the landmark system, 1-norm
};

}  // namespace brachy
