#pragma once

#include <cstdint>
#include <string_view>

#include "core/dose/dose_seed.h"
#include "core/math/rigid_transform.h"

namespace brachy {

/// Why a needle did not let go of a seed that it was asked for. The seed stays in the needle.
enum class DropRefusal : std::uint8_t {
  kNone = 0,
  kNotInTissue = 1,    ///< the tip is not in the tissue
  kNothingLoaded = 2,  ///< none left of the plan's in this hole, or no hole of the plan is there
  kFull = 3,           ///< seeds.max_count have fallen
  kFolded = 4,         ///< the field folds: where the seed belongs at rest is not one place
  kAmbiguous = 5,      ///< nobody knows whether it folds, and several places were found
  kNotConverged = 6,   ///< the place at rest was not found
};

constexpr std::string_view to_string(DropRefusal refusal) {
  switch (refusal) {
    case DropRefusal::kNone:
      return "none";
    case DropRefusal::kNotInTissue:
      return "the tip is not in the tissue";
    case DropRefusal::kNothingLoaded:
      return "no seed of the plan is left for this hole";
    case DropRefusal::kFull:
      return "seeds.max_count have been dropped; raise it in the scene";
    case DropRefusal::kFolded:
      return "the tissue is folded there; move the needle back a little";
    case DropRefusal::kAmbiguous:
      return "it is not certain where in the tissue that is; move the needle back a little";
    case DropRefusal::kNotConverged:
      return "the place in the tissue was not found; move the needle back a little";
  }
  return "unknown";
}

/// What a device needle was asked to drop, since start.
struct DropCounts {
  std::uint32_t dropped = 0;
  std::uint32_t refused = 0;
  DropRefusal last_refusal = DropRefusal::kNone;
};

/// A seed that is to fall now.
struct SeedDrop {
  std::int32_t planned;
  SourceModel source;
  double air_kerma_strength_u;
  Vec3 at;  ///< its centre, mm, world
};

}  // namespace brachy
