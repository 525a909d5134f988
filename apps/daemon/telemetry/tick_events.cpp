#include "apps/daemon/telemetry/tick_events.h"

#include <fmt/format.h>

#include <algorithm>

namespace brachy {

TickEvents::TickEvents(const MeshState& start, std::vector<PlannedSeed> planned)
    : planned_(std::move(planned)),
      last_(start.needles.states),
      run_(start.summary.run),
      seed_count_(start.seeds.count) {}

// A new run: its counters start at 0; its seeds are none, or those of the run before.
void TickEvents::restart_from_full_frame(const MeshState& state) {
  run_ = state.summary.run;
  for (std::size_t n = 0; n < last_.size(); ++n) {
    last_[n].puncture_count = 0;
    last_[n].drops.refused = std::min(last_[n].drops.refused, state.needles.states[n].drops.refused);
  }
  seed_count_ = std::min(seed_count_, state.seeds.count);
  guard_ = {};  // its rate limit counts simulated time, which may have gone back
}

std::vector<net::EventMessage> TickEvents::update(const MeshState& state) {
  std::vector<net::EventMessage> events;
  const std::uint64_t tick = state.summary.tick;
  if (state.summary.run != run_) restart_from_full_frame(state);
  for (std::size_t n = 0; n < last_.size(); ++n) {
    const NeedleState& needle = state.needles.states[n];
    const auto id = static_cast<std::uint16_t>(n);
    if (needle.puncture_count != last_[n].puncture_count)
      events.push_back({net::EventKind::kPuncture, id, tick, "capsule punctured"});
    if (needle.contact != last_[n].contact)
      events.push_back({net::EventKind::kContact, id, tick, std::string(to_string(needle.contact))});
    if (const std::uint32_t refused = needle.drops.refused - last_[n].drops.refused) {
      drops_refused_ += refused;
      events.push_back({net::EventKind::kSeed, id, tick,
                        "no seed dropped: " + std::string(to_string(needle.drops.last_refusal))});
    }
    last_[n] = needle;
  }
  for (; seed_count_ < state.seeds.count; ++seed_count_) {
    const Seed& seed = state.seeds.in_tissue()[seed_count_];
    ++seeds_dropped_;
    events.push_back({net::EventKind::kSeed, seed.needle, seed.tick, text_of(seed)});
  }
  if (auto warning = guard_.update(state.summary))
    events.push_back({net::EventKind::kWarning, 0, tick, std::move(*warning)});
  return events;
}

std::string TickEvents::text_of(const Seed& seed) const {
  const Vec3& at = seed.rest;
  std::string text =
      fmt::format("seed {} dropped, at rest at ({:.1f}, {:.1f}, {:.1f}) mm", seed.id, at.x(), at.y(), at.z());
  if (seed.planned >= 0 && static_cast<std::size_t>(seed.planned) < planned_.size())
    text += fmt::format(", {:.1f} mm from where the plan has it",
                        (at - planned_[static_cast<std::size_t>(seed.planned)].position).norm());
  return text;
}

}  // namespace brachy
