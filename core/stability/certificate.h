#pragma once

#include <cstdint>
#include <limits>
#include <string_view>

#include "core/math/rigid_transform.h"

namespace brachy {

/// What is known of a displacement field over the continuum, not only at vertices. Values go over the wire: append only.
enum class Verdict : std::uint8_t {
  kUnknown = 0,    ///< neither could be shown within the work a tick may take
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

/// A tick's field, certified: carried by every MeshState and FRAME. As it stands here: the tissue at rest.
struct Certificate {
  static constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

  Verdict verdict = Verdict::kInjective;
  /// Lower bound of det(I + ∇u) over the continuum; of composed sub-steps, the product of theirs. NaN unless injective.
  double det_bound = 1;
  double vertex_det = 1;      ///< the least det(I + ∇u) at the tissue's vertices
  Vec3 place = Vec3::Zero();  ///< rest position of the fold, or else of the least det found, mm, world frame
  double margin_mm =
      kNotKnown;  ///< the landmark displaced most may go at least this much further as it goes; NaN: none is
  std::uint32_t substeps = 0;  ///< fields composed: 0 at rest, 1 the plain field
  double held_mm =
      0;  ///< the largest part of a landmark's displacement that the tissue was not made to follow
  double held_n = kNotKnown;  ///< the force of that part, N; NaN: nothing is held, or sub-steps were composed
  double condition = 1;       ///< estimated condition number of the landmark system, 1-norm
};

}  // namespace brachy
