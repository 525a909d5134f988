#pragma once

#include <cstdint>
#include <string_view>

#include "core/base/rigid_transform.h"
#include "core/brachytherapy/dose/dose_seed.h"

namespace brachy {

/// Why a needle did not drop a requested seed. The seed stays in the needle.
enum class DropRefusal : std::uint8_t {
  kNone = 0,
  kNotInTissue = 1,    ///< the tip is not in the tissue
  kNothingLoaded = 2,  ///< the plan has no seed left for this hole, or the needle is in none of its holes
  kFull = 3,           ///< seeds.max_count have fallen
  kFolded = 4,         ///< the field folds: the position at rest is not unique
  kAmbiguous = 5,      ///< folding is unknown, and several positions were found
  kNotConverged = 6,   ///< the position at rest was not found
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
      return "the position in the tissue is ambiguous; move the needle back a little";
    case DropRefusal::kNotConverged:
      return "the position in the tissue was not found; move the needle back a little";
  }
  return "unknown";
}

/// Seeds requested from a device needle since the start.
struct DropCounts {
  std::uint32_t dropped = 0;
  std::uint32_t refused = 0;
  DropRefusal last_refusal = DropRefusal::kNone;
};

/// A seed to drop now.
struct SeedDrop {
  std::int32_t planned;
  SourceModel source;
  double air_kerma_strength_u;
  Vec3 at;  ///< its centre, mm, world
};

}  // namespace brachy
