// Seeds and their dose on the wire: the FRAME's sections SEEDS and BUTTONS, DROP and DOSE.
#include "net/wire/seed_codec.h"

#include <algorithm>
#include <cmath>

#include "net/wire/codec.h"
#include "net/wire/sections.h"

namespace brachy::net {
namespace {

constexpr std::size_t kSeedBytes = 208;
constexpr std::size_t kHeldBytes = 16;
constexpr std::uint32_t kCertified = 1;  // bit of a seed's flags
constexpr std::size_t kStructureBytes = 2 + 12 * 8 + 2;
constexpr std::uint16_t kMaxBins = 4096;
constexpr std::uint16_t kAtSurfaceSection = 1;  // of DOSE

double finite_seed(ByteReader& reader) {
  const double value = reader.f64();
  if (!std::isfinite(value)) reader.fail("a seed's place, time or strength is not finite");
  return value;
}

void write_seed(ByteWriter& writer, const Seed& seed) {
  writer.u32(seed.id);
  writer.u32(static_cast<std::uint32_t>(seed.planned));
  writer.u16(seed.needle);
  writer.u16(static_cast<std::uint16_t>(seed.source));
  writer.u32(seed.is_certified ? kCertified : 0);
  writer.u64(seed.tick);
  writer.f64(seed.t_s);
  writer.f64(seed.air_kerma_strength_u);
  for (const Vec3* v : {&seed.dropped, &seed.dropped_axis, &seed.rest, &seed.rest_axis, &seed.gland_motion,
                        &seed.position, &seed.axis})
    for (int k = 0; k < 3; ++k) writer.f64((*v)[k]);
}

Seed read_seed(ByteReader& reader) {
  Seed seed;
  seed.id = reader.u32();
  seed.planned = static_cast<std::int32_t>(reader.u32());
  seed.needle = reader.u16();
  seed.source = static_cast<SourceModel>(reader.u16());  // one of a later version stays as it is
  seed.is_certified = (reader.u32() & kCertified) != 0;
  seed.tick = reader.u64();
  seed.t_s = finite_seed(reader);
  seed.air_kerma_strength_u = finite_seed(reader);
  for (Vec3* v : {&seed.dropped, &seed.dropped_axis, &seed.rest, &seed.rest_axis, &seed.gland_motion,
                  &seed.position, &seed.axis})
    for (int k = 0; k < 3; ++k) (*v)[k] = finite_seed(reader);
  return seed;
}

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

}  // namespace

void write_seeds(ByteWriter& writer, const FrameMessage& message) {
  write_section_head(writer, static_cast<std::uint16_t>(FrameSection::kSeeds),
                     8 + kSeedBytes * message.seeds.size());
  writer.u32(message.seed_count);
  writer.u32(static_cast<std::uint32_t>(message.seeds.size()));
  for (const Seed& seed : message.seeds) write_seed(writer, seed);
}

void read_seeds(ByteReader& reader, FrameMessage& message) {
  message.seed_count = reader.u32();
  const std::uint32_t count = reader.u32();
  message.seeds.clear();
  if (reader.fits(count, kSeedBytes)) message.seeds.resize(count);
  std::uint32_t last = 0;
  for (Seed& seed : message.seeds) {
    seed = read_seed(reader);
    if (seed.id <= last || seed.id > message.seed_count) reader.fail("the seeds are out of order");
    last = seed.id;
  }
  if (message.full && count != message.seed_count) reader.fail("a full frame lacks seeds");
}

std::vector<HeldTicks> held_ticks(const FrameMessage& message) {
  std::vector<HeldTicks> held;
  add_held(0, message.pose_history, held);
  for (const NeedlePoses& needle : message.poses_of_needles) add_held(needle.needle, needle.poses, held);
  return held;
}

void write_buttons(ByteWriter& writer, const std::vector<HeldTicks>& held) {
  write_section_head(writer, static_cast<std::uint16_t>(FrameSection::kButtons),
                     4 + kHeldBytes * held.size());
  writer.u32(static_cast<std::uint32_t>(held.size()));
  for (const HeldTicks& run : held) {
    writer.u16(run.needle);
    writer.u16(0);
    writer.u32(run.count);
    writer.u64(run.first);
  }
}

std::vector<HeldTicks> read_buttons(ByteReader& reader) {
  std::vector<HeldTicks> held;
  const std::uint32_t count = reader.u32();
  if (reader.fits(count, kHeldBytes)) held.resize(count);
  for (HeldTicks& run : held) {
    run.needle = reader.u16();
    reader.u16();
    run.count = reader.u32();
    run.first = reader.u64();
  }
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

void encode_body(const DropMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u16(message.needle);
  writer.u8(message.pressed ? 1 : 0);
  writer.u8(0);
  writer.u32(0);
}

DecodeResult decode_body(std::span<const std::byte> body, DropMessage& message) {
  ByteReader reader(body);
  message.needle = reader.u16();
  const std::uint8_t pressed = reader.u8();
  if (pressed > 1) reader.fail("pressed is neither 0 nor 1");
  message.pressed = pressed == 1;
  reader.u8();
  reader.u32();
  return DecodeResult::of(reader);
}

namespace {

/// The numbers of a StructureDose in the order of the wire.
template <class Dose, class Visit>
void visit_numbers(Dose& dose, Visit&& visit) {
  for (auto* number :
       {&dose.volume_cc, &dose.mean_gy, &dose.min_gy, &dose.max_gy, &dose.v100_percent, &dose.v150_percent,
        &dose.v200_percent, &dose.v100_cc, &dose.d90_gy, &dose.d30_gy, &dose.d10_gy, &dose.d2cc_gy})
    visit(*number);
}

}  // namespace

void encode_body(const DoseMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u32(message.seeds);
  writer.u16(static_cast<std::uint16_t>(message.structures.size()));
  writer.u16(0);
  writer.f64(message.prescription_gy);
  writer.f64(message.air_kerma_strength_u);
  for (const StructureDose& dose : message.structures) {
    writer.text(dose.name, kMaxNameBytes);
    visit_numbers(dose, [&](double number) { writer.f64(number); });
    writer.u16(static_cast<std::uint16_t>(dose.volume_share.size()));
    writer.floats(dose.volume_share);
  }
  if (message.surface_gy.empty()) return write_no_sections(writer);
  writer.u32(1);
  write_section_head(writer, kAtSurfaceSection, 8 + 4 * message.surface_gy.size());
  writer.u32(static_cast<std::uint32_t>(message.surface_gy.size()));
  writer.u32(0);
  writer.floats(message.surface_gy);
}

DecodeResult decode_body(std::span<const std::byte> body, DoseMessage& message) {
  ByteReader reader(body);
  message.seeds = reader.u32();
  const std::uint16_t count = reader.u16();
  reader.u16();
  message.prescription_gy = reader.f64();
  message.air_kerma_strength_u = reader.f64();
  message.structures.clear();
  if (reader.fits(count, kStructureBytes)) message.structures.resize(count);
  for (StructureDose& dose : message.structures) {
    dose.name = reader.text(kMaxNameBytes);
    visit_numbers(dose, [&](double& number) { number = reader.f64(); });
    const std::uint16_t bins = reader.u16();
    if (bins > kMaxBins) reader.fail("a structure has too many bins");
    if (reader.fits(bins, sizeof(float))) reader.floats(bins, dose.volume_share);
  }
  message.surface_gy.clear();
  read_known_sections(reader, [&](std::uint16_t id, ByteReader& section) {
    if (id != kAtSurfaceSection) return false;
    const std::uint32_t vertices = section.u32();
    section.u32();
    section.floats(vertices, message.surface_gy);
    return true;
  });
  return DecodeResult::of(reader);
}

}  // namespace brachy::net
