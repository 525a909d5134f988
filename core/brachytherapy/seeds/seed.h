#pragma once

#include <cstdint>

#include "core/base/rigid_transform.h"
#include "core/brachytherapy/dose/dose_seed.h"

namespace brachy {

/// A seed that a needle has left in the body, most often in the tissue. What happened when it fell does not change
/// any more; `position` and `axis` move with the tissue. mm, world frame W; axes are unit, along the needle towards
/// its tip.
struct Seed {
  static constexpr std::int32_t kUnplanned = -1;
  static constexpr std::uint16_t kNoNeedle = UINT16_MAX;

  std::uint32_t id = 0;               ///< 1, 2, … in the order of falling
  std::uint64_t tick = 0;             ///< in which it fell
  double t_s = 0;                     ///< simulated time then
  std::uint16_t needle = 0;           ///< device needle that left it; kNoNeedle: it was there at the start
  bool is_certified = false;          ///< the field it fell in is injective, so its material point is unique
  bool is_fixed = false;              ///< fell outside the tissue: does not move with it, `rest` is `dropped`
  std::int32_t planned = kUnplanned;  ///< its index in Plan::seeds, or kUnplanned
  SourceModel source = SourceModel::kAmersham6711;
  double air_kerma_strength_u = 0;

  Vec3 dropped = Vec3::Zero();  ///< where it fell: the needle's tip
  Vec3 dropped_axis = Vec3::UnitZ();
  Vec3 rest = Vec3::Zero();  ///< its material point: its position once no needle deforms the tissue
  Vec3 rest_axis = Vec3::UnitZ();
  Vec3 gland_motion = Vec3::Zero();  ///< mean displacement of the tissue's points when it fell

  Vec3 position = Vec3::Zero();  ///< now: rest + u(rest)
  Vec3 axis = Vec3::UnitZ();

  bool was_there() const { return needle == kNoNeedle; }  ///< before anything happened (implant.seeds)
  DoseSeed as_dropped() const { return {dropped, dropped_axis, source, air_kerma_strength_u}; }
  DoseSeed at_rest() const { return {rest, rest_axis, source, air_kerma_strength_u}; }
  bool operator==(const Seed&) const = default;
};

}  // namespace brachy
