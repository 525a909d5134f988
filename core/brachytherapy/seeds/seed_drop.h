#pragma once

#include <cstdint>
#include <string_view>

#include "core/base/rigid_transform.h"
#include "core/brachytherapy/dose/dose_seed.h"

namespace brachy {

/// Why a requested seed is not in the body. It stays in the needle, but for kLost.
enum class DropRefusal : std::uint8_t {
  kNone = 0,
  kNotInTissue = 1,    ///< of earlier versions: the tip is not in the tissue
  kNothingLoaded = 2,  ///< the needle is empty, and no other of the plan's is loaded for its hole
  kFull = 3,           ///< seeds.max_count have fallen
  kFolded = 4,         ///< the field folds at the very tip
  kAmbiguous = 5,      ///< of earlier versions: folding is unknown, and several positions were found
  kNotConverged = 6,   ///< the position at rest was not found
  kLost = 7,           ///< the tip is outside the body: the seed has left the needle and is lost
};

constexpr std::string_view to_string(DropRefusal refusal) {
  switch (refusal) {
    case DropRefusal::kNone:
      return "none";
    case DropRefusal::kNotInTissue:
      return "the tip is not in the tissue";
    case DropRefusal::kNothingLoaded:
      return "the needle is empty, and the plan has no other for this hole";
    case DropRefusal::kFull:
      return "seeds.max_count have been dropped; raise it in the scene";
    case DropRefusal::kFolded:
      return "the tissue is folded there; move the needle back a little";
    case DropRefusal::kAmbiguous:
      return "the position in the tissue is ambiguous; move the needle back a little";
    case DropRefusal::kNotConverged:
      return "the position in the tissue was not found; move the needle back a little";
    case DropRefusal::kLost:
      return "the tip was outside the body, and the seed is lost";
  }
  return "unknown";
}

/// Seeds requested from a device needle since the start; those lost count as refused.
struct DropCounts {
  std::uint32_t dropped = 0;
  std::uint32_t refused = 0;
  DropRefusal last_refusal = DropRefusal::kNone;
};

/// A seed that was asked for and is not in the body.
struct FailedDrop {
  std::uint64_t tick = 0;
  double t_s = 0;            ///< simulated time
  std::uint16_t needle = 0;  ///< device needle
  std::int32_t planned =
      kNotPlanned;  ///< its index in Plan::seeds; kNotPlanned: of none, or no seed was left
  DropRefusal why = DropRefusal::kNone;  ///< kLost: it has left the needle
  Vec3 at = Vec3::Zero();                ///< the tip, mm, world

  static constexpr std::int32_t kNotPlanned = -1;
};

/// A seed to drop now.
struct SeedDrop {
  std::int32_t planned;
  SourceModel source;
  double air_kerma_strength_u;
  Vec3 at;  ///< its centre, mm, world
};

}  // namespace brachy
