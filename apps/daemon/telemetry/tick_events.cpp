#include "apps/daemon/telemetry/tick_events.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/brachytherapy/structures/tested_organs.h"
#include "core/simulation/new_failed_drops.h"

namespace brachy {

TickEvents::TickEvents(const MeshState& start, std::vector<PlannedSeed> planned,
                       std::vector<std::string> organs)
    : planned_(std::move(planned)),
      last_(start.needles.states),
      organs_(std::move(organs)),
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
  failed_drops_ = std::min(failed_drops_, state.failed_drops.count);
  last_contacts_.clear();
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
    drops_refused_ += needle.drops.refused - last_[n].drops.refused;
    last_[n] = needle;
  }
  add_failed_drops(state, events);
  add_organs(state, events);
  for (; seed_count_ < state.seeds.count; ++seed_count_) {
    const Seed& seed = state.seeds.in_tissue()[seed_count_];
    ++seeds_dropped_;
    events.push_back({net::EventKind::kSeed, seed.needle, seed.tick, text_of(seed)});
  }
  if (auto warning = guard_.update(state.summary))
    events.push_back({net::EventKind::kWarning, 0, tick, std::move(*warning)});
  return events;
}

void TickEvents::add_failed_drops(const MeshState& state, std::vector<net::EventMessage>& events) {
  visit_new(state.failed_drops, failed_drops_, [&](const FailedDrop& drop) {
    if (drop.why == DropRefusal::kLost)
      events.push_back({net::EventKind::kSeedLost, drop.needle, drop.tick,
                        fmt::format("{}, at ({:.1f}, {:.1f}, {:.1f}) mm", to_string(drop.why), drop.at.x(),
                                    drop.at.y(), drop.at.z())});
    else
      events.push_back({net::EventKind::kSeed, drop.needle, drop.tick,
                        "no seed dropped: " + std::string(to_string(drop.why))});
  });
}

void TickEvents::add_organs(const MeshState& state, std::vector<net::EventMessage>& events) {
  const std::vector<OrganContact>& now = state.needles.organ_contacts;
  last_contacts_.resize(now.size());
  for (std::size_t i = 0; i < now.size() && !organs_.empty(); ++i) {
    const auto needle = static_cast<std::uint16_t>(i / organs_.size());
    const std::string& organ = organs_[i % organs_.size()];
    const OrganContact& last = last_contacts_[i];
    const auto add = [&](std::uint64_t tick, std::string text) {
      events.push_back({net::EventKind::kStructure, needle, tick, std::move(text)});
    };
    const bool is_new = now[i].passes != last.passes;
    if (is_new)
      add(now[i].entered_tick, organ == TestedOrgan::kBone ? "the needle met bone: the pubic arch"
                                                           : "the needle entered the " + organ);
    if (!now[i].is_in && (is_new || last.is_in))
      add(now[i].left_tick, fmt::format("the needle left the {}: {:.1f} mm deep, {:.2f} s", organ,
                                        now[i].depth_mm, now[i].time_s));
    last_contacts_[i] = now[i];
  }
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
