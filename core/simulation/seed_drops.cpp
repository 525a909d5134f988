#include "core/simulation/seed_drops.h"

#include <algorithm>

#include "core/simulation/body_motion.h"

namespace brachy {

SeedDrops::SeedDrops(const SimulationModel& model)
    : model_(model),
      loading_(model.settings.seeds, model.settings.template_grid, model.plan, model.settings.needle.count),
      implant_(static_cast<std::size_t>(model.settings.seeds.max_count)) {
  implant_.restore(model.seeds_at_start);
}

void SeedDrops::restore(std::span<const Seed> seeds) {
  implant_.restore(seeds);
  for (const Seed& seed : seeds) loading_.mark_dropped(seed.planned);
}

void SeedDrops::restore_lost(std::span<const std::int32_t> planned) {
  for (const std::int32_t seed : planned) loading_.mark_dropped(seed);
}

void SeedDrops::resume_from(const SeedDrops& other, std::uint64_t tick, GuardedField& field,
                            const BodyFrame& frame) noexcept {
  implant_ = other.implant_;
  move(tick, field, frame);
  loading_ = other.loading_;
  failed_ = other.failed_;
}

void SeedDrops::move(std::uint64_t tick, GuardedField& field, const BodyFrame& frame) noexcept {
  MovedField moved(field, frame);
  implant_.move(tick, moved);
}

void SeedDrops::drop(std::uint64_t tick, Instruments& instruments, const DeformedTissue& tissue) noexcept {
  for (std::size_t n = 0; n < instruments.needles().size(); ++n) {
    NeedleState& state = instruments.states()[n];
    const NeedleShape& shape = state.shape;
    NeedlePose pose = state.input;
    pose.X_WN = state.X_WN;
    loading_.update(n, pose, instruments.is_in_tissue(n),
                    shape.is_bent ? shape.tip_deflection : Vec3(Vec3::Zero()));
    if (loading_.request_failed(n))
      refuse(tick, n, DropRefusal::kNothingLoaded, pose.X_WN.p, FailedDrop::kNotPlanned, state.drops);
    while (const auto due = loading_.due(n)) drop_one(tick, n, *due, instruments, tissue);
  }
}

void SeedDrops::drop_one(std::uint64_t tick, std::size_t needle, const SeedDrop& due,
                         Instruments& instruments, const DeformedTissue& tissue) noexcept {
  DropCounts& counts = instruments.states()[needle].drops;
  // In front of the template the needle is in the hand.
  if (due.at.z() < model_.settings.template_grid.origin_mm.z()) {
    loading_.dropped(needle);
    refuse(tick, needle, DropRefusal::kLost, due.at, due.planned, counts);
    return;
  }
  const Seed seed = falling(tick, needle, due, instruments, tissue.mesh);
  const MovedField field(tissue.field, tissue.frame);
  const bool is_in = instruments.is_in_tissue(needle);
  const Vec3 material_tip = is_in ? instruments.needles()[needle].material_tip() : seed.dropped;
  const DropRefusal refusal =
      implant_.drop(seed, {model_.surface, field, tissue.field.certificate().verdict, material_tip, is_in});
  if (refusal == DropRefusal::kNone) {
    loading_.dropped(needle);
    ++counts.dropped;
  } else if (loading_.refused(needle)) {
    refuse(tick, needle, refusal, due.at, due.planned, counts);
  }
}

// What is known of a seed when it leaves its needle.
Seed SeedDrops::falling(std::uint64_t tick, std::size_t needle, const SeedDrop& due,
                        const Instruments& instruments, const ShownMesh& mesh) const noexcept {
  const NeedleState& state = instruments.states()[needle];
  Seed seed;
  seed.tick = tick;
  seed.t_s = static_cast<double>(tick) * model_.settings.period_s;
  seed.needle = static_cast<std::uint16_t>(needle);
  seed.planned = due.planned;
  seed.source = due.source;
  seed.air_kerma_strength_u = due.air_kerma_strength_u;
  seed.dropped_axis = state.shape.is_bent ? state.shape.tip_axis : Vec3(state.X_WN.R.col(2));
  const auto id = static_cast<std::uint32_t>(implant_.seeds().size() + 1);
  seed.dropped = due.at + instruments.noise().drop_offset(id, seed.dropped_axis);
  seed.gland_motion = mesh.mean_displacement();
  return seed;
}

void SeedDrops::refuse(std::uint64_t tick, std::size_t needle, DropRefusal why, const Vec3& at,
                       std::int32_t planned, DropCounts& counts) noexcept {
  ++counts.refused;
  counts.last_refusal = why;
  failed_.slots[failed_.count++ % FailedDrops::kKept] = {tick,
                                                         static_cast<double>(tick) * model_.settings.period_s,
                                                         static_cast<std::uint16_t>(needle),
                                                         planned,
                                                         why,
                                                         at};
}

void SeedDrops::write(std::uint64_t since, SeedStates& seeds, FailedDrops& failed) const noexcept {
  const std::span<const Seed> in_tissue = implant_.seeds();
  for (std::size_t i = 0; i < in_tissue.size(); ++i) {
    if (i < seeds.count && implant_.changed_tick(i) <= since) continue;
    seeds.slots[i] = in_tissue[i];
    seeds.ticks[i] = implant_.changed_tick(i);
  }
  seeds.count = static_cast<std::uint32_t>(in_tissue.size());
  for (std::uint64_t& i = failed.count; i < failed_.count; ++i)
    failed.slots[i % FailedDrops::kKept] = failed_.slots[i % FailedDrops::kKept];
}

}  // namespace brachy
