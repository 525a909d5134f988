// DOSE, and the buttons in a FRAME.
#include "net/wire/seed_fields.h"

namespace brachy::net {
namespace {

constexpr std::size_t kStructureDoseBytes = 2 + 12 * 8 + 2;
constexpr std::uint16_t kMaxBins = 4096;
constexpr std::uint16_t kAtSurfaceSection = 1, kWithPlannedSection = 2, kFractionSection = 3;  // of DOSE

/// The ticks of one needle's history in which its button was held, as runs.
void add_held(std::uint16_t needle, const std::vector<TickPose>& poses, std::vector<HeldTicks>& held) {
  bool is_run = false;
  std::uint64_t next = 0;
  for (const TickPose& pose : poses) {
    if (is_run && pose.button && pose.tick == next)
      ++held.back().count;
    else if (pose.button)
      held.push_back({needle, pose.tick, 1});
    is_run = pose.button;
    next = pose.tick + 1;
  }
}

void structure_dose_fields(auto& archive, auto& dose) {
  archive.text(dose.name, kMaxNameBytes);
  for (auto* number :
       {&dose.volume_cc, &dose.mean_gy, &dose.min_gy, &dose.max_gy, &dose.v100_percent, &dose.v150_percent,
        &dose.v200_percent, &dose.v100_cc, &dose.d90_gy, &dose.d30_gy, &dose.d10_gy, &dose.d2cc_gy})
    archive.f64(*number);
  const std::uint16_t bins = archive.u16_count(dose.volume_share);
  archive.check(bins <= kMaxBins, "a structure has too many bins");
  archive.floats(dose.volume_share, bins);
}

}  // namespace

std::vector<HeldTicks> held_ticks(const FrameMessage& message) {
  std::vector<HeldTicks> held;
  add_held(0, message.pose_history, held);
  for (const NeedlePoses& needle : message.poses_of_needles) add_held(needle.needle, needle.poses, held);
  return held;
}

void apply_buttons(const std::vector<HeldTicks>& held, FrameMessage& message) {
  const auto apply = [](const HeldTicks& run, std::vector<TickPose>& poses) {
    for (TickPose& pose : poses)
      if (pose.tick >= run.first && pose.tick - run.first < run.count) pose.button = true;
  };
  for (const HeldTicks& run : held) {
    if (run.needle == 0) apply(run, message.pose_history);
    for (NeedlePoses& needle : message.poses_of_needles)
      if (needle.needle == run.needle) apply(run, needle.poses);
  }
}

template <class Archive>
void fields(Archive& archive, MaybeConst<DoseMessage> auto& message) {
  archive.u32(message.seeds);
  const std::uint16_t count = archive.u16_count(message.structures);
  archive.reserved(2);
  archive.f64(message.prescription_gy);
  archive.f64(message.air_kerma_strength_u);
  archive.items(message.structures, count, kStructureDoseBytes,
                [&](auto& dose) { structure_dose_fields(archive, dose); });
  archive.sections(Section{kAtSurfaceSection, !message.surface_gy.empty(),
                           [&](auto& section) {
                             const std::uint32_t vertices = section.u32_count(message.surface_gy);
                             section.reserved(4);
                             section.floats(message.surface_gy, vertices);
                           }},
                   Section{kWithPlannedSection, !message.with_planned.empty(),
                           [&](auto& section) {
                             const std::uint16_t planned = section.u16_count(message.with_planned);
                             section.reserved(6);
                             section.items(message.with_planned, planned, kStructureDoseBytes,
                                           [&](auto& dose) { structure_dose_fields(section, dose); });
                           }},
                   Section{kFractionSection, message.fraction.has_value(), [&](auto& section) {
                             if constexpr (Archive::kReads) message.fraction.emplace();
                             auto& fraction = *message.fraction;
                             section.u32(fraction.catheters);
                             section.u32(fraction.planned_catheters);
                             section.u32(fraction.dwells);
                             section.reserved(4);
                             section.f64(fraction.seconds);
                           }});
}
BRACHY_CODEC(DoseMessage);

}  // namespace brachy::net
