#pragma once

#include <cmath>
#include <vector>

#include "net/wire/fields.h"

/// The payloads of a FRAME's sections SEEDS and BUTTONS.
namespace brachy::net {

void finite_seed(auto& archive, auto&& value) {
  archive.f64(value);
  archive.check(std::isfinite(value), "a seed's place, time or strength is not finite");
}

/// 208 bytes.
void seed_fields(auto& archive, auto& seed) {
  archive.u32(seed.id);
  archive.u32(seed.planned);
  archive.u16(seed.needle);
  archive.u16(seed.source);  // a source model of a later version stays as it is
  archive.u32_bits(seed.is_certified, seed.is_fixed);
  archive.u64(seed.tick);
  finite_seed(archive, seed.t_s);
  finite_seed(archive, seed.air_kerma_strength_u);
  for (auto* v : {&seed.dropped, &seed.dropped_axis, &seed.rest, &seed.rest_axis, &seed.gland_motion,
                  &seed.position, &seed.axis})
    for (int k = 0; k < 3; ++k) finite_seed(archive, (*v)[k]);
}

/// SEEDS.
void seeds_section(auto& archive, MaybeConst<FrameMessage> auto& message) {
  constexpr std::size_t kSeedBytes = 208;
  archive.u32(message.seed_count);
  const std::uint32_t count = archive.u32_count(message.seeds);
  std::uint32_t last = 0;
  archive.items(message.seeds, count, kSeedBytes, [&](auto& seed) {
    seed_fields(archive, seed);
    archive.check(seed.id > last && seed.id <= message.seed_count, "the seeds are out of order");
    last = seed.id;
  });
  archive.check(!message.full || count == message.seed_count, "a full frame lacks seeds");
}

/// Ticks in which a needle's button was held, as BUTTONS lists them.
struct HeldTicks {
  std::uint16_t needle = 0;
  std::uint64_t first = 0;
  std::uint32_t count = 0;
};

/// BUTTONS.
void buttons_section(auto& archive, MaybeConst<std::vector<HeldTicks>> auto& held) {
  constexpr std::size_t kHeldBytes = 16;
  archive.u32_list(held, kHeldBytes, [&](auto& run) {
    archive.u16(run.needle);
    archive.reserved(2);
    archive.u32(run.count);
    archive.u64(run.first);
  });
}

/// The buttons of all needles in the frame's histories.
std::vector<HeldTicks> held_ticks(const FrameMessage& message);
/// Sets TickPose::button in the frame's histories.
void apply_buttons(const std::vector<HeldTicks>& held, FrameMessage& message);

}  // namespace brachy::net
