// The mesh: TOPOLOGY once, FRAME at every snapshot.
#include <algorithm>
#include <cassert>
#include <cmath>

#include "net/wire/force_fields.h"
#include "net/wire/seed_fields.h"
#include "net/wire/shape_fields.h"

namespace brachy::net {
namespace {

constexpr std::size_t kNeedleBytes = 116;    // wire size of one needle record
constexpr std::size_t kTickPoseBytes = 104;  // wire size of one POSE_HISTORY entry
constexpr std::size_t kRangeBytes = 8;
constexpr std::size_t kCertificateBytes = 80;
constexpr std::size_t kForceBytes = 24 + 14 * 8;  // one entry of FORCE

constexpr std::uint16_t number(FrameSection section) {
  return static_cast<std::uint16_t>(section);
}

void needle_fields(auto& archive, auto& needle) {
  archive.u16(needle.id);
  archive.u8(needle.state.contact);
  archive.u8_bool(needle.state.present, "a needle's present field is neither 0 nor 1");
  archive.u32(needle.state.landmark_count);
  archive.u32(needle.state.puncture_count);
  archive.f64(needle.state.insertion_depth_mm);
  archive.pose(needle.state.X_WN);
}

/// Returns how many points the ranges hold.
std::uint64_t ranges_fields(auto& archive, MaybeConst<FrameMessage> auto& message) {
  std::uint64_t points = 0;
  std::uint64_t end = 0;
  archive.u32_list(message.ranges, kRangeBytes, [&](auto& range) {
    archive.u32(range.first);
    archive.u32(range.count);
    archive.check(range.count > 0, "a range is empty");
    archive.check(range.first >= end, "the ranges are out of order or overlap");
    end = std::uint64_t{range.first} + range.count;
    archive.check(end <= message.point_count, "a range goes past the last point");
    points += range.count;
  });
  archive.check(!message.full ||
                    (message.base_tick == 0 && points == message.point_count && message.ranges.size() <= 1),
                "a full frame must have base tick 0 and one range with every point");
  return points;
}

std::size_t forces_count(const FrameMessage& message) {
  return static_cast<std::size_t>(std::ranges::count_if(message.needles, &NeedleRecord::has_forces));
}

/// An entry of FORCE but for its needle's id.
void force_entry_fields(auto& archive, auto& state) {
  archive.reserved(6);
  archive.u64(state.input.sequence);
  archive.time(state.input.stamp_ns);
  needle_forces_fields(archive, state.forces);
  archive.f64(state.tip_depth_mm);
}

/// FORCE: its entries belong to the needles with forces, not to a list of their own.
void forces_section(FieldWriter& archive, const FrameMessage& message) {
  archive.u16(forces_count(message));
  archive.reserved(2);
  for (const NeedleRecord& needle : message.needles) {
    if (!needle.has_forces) continue;
    archive.u16(needle.id);
    force_entry_fields(archive, needle.state);
  }
}

void forces_section(FieldReader& archive, FrameMessage& message) {
  std::uint16_t count = 0;
  archive.u16(count);
  archive.reserved(2);
  archive.fits(count, kForceBytes);
  for (std::uint16_t i = 0; i < count && archive.ok(); ++i) {
    std::uint16_t id = 0;
    archive.u16(id);
    const auto needle = std::ranges::find(message.needles, id, &NeedleRecord::id);
    archive.check(needle != message.needles.end(), "a force names a needle that is not there");
    if (!archive.ok()) return;
    needle->has_forces = true;
    force_entry_fields(archive, needle->state);
  }
}

/// A verdict of a later version stays as it is, like a contact state: its name is "unknown".
void certificate_fields(auto& archive, auto& certificate) {
  archive.u8(certificate.verdict);
  archive.reserved(3);
  archive.u32(certificate.substeps);
  archive.f64(certificate.det_bound);
  archive.f64(certificate.vertex_det);
  archive.vec3(certificate.place);
  archive.f64(certificate.margin_mm);
  archive.f64(certificate.held_mm);
  archive.f64(certificate.held_n);
  archive.f64(certificate.condition);
}

void poses_fields(auto& archive, std::uint64_t newest_tick, auto& poses) {
  std::uint64_t last = 0;
  archive.u32_list(poses, kTickPoseBytes, [&](auto& entry) {
    archive.u64(entry.tick);
    archive.pose(entry.X_WN);
    archive.check(entry.tick > last && entry.tick <= newest_tick, "the pose history is out of order");
    last = entry.tick;
  });
}

}  // namespace

/// Keeps the memory of the arrays: a client decodes 30 frames a second into the same message.
void reset_message(FrameMessage& message) {
  message.certificate.reset();
  message.has_pose_history = false;
  message.pose_history.clear();
  message.poses_of_needles.clear();
  message.has_seeds = false;
  message.seed_count = 0;
  message.seeds.clear();
  message.lag_mm = Certificate::kNotKnown;
}

template <class Archive>
void fields(Archive& archive, MaybeConst<FrameMessage> auto& message) {
  archive.u64(message.topology_hash);
  archive.u64(message.tick);
  archive.f64(message.sim_time_s);
  archive.u64(message.snapshot_sequence);
  archive.u64(message.base_tick);
  archive.u64(message.overruns);
  archive.time(message.publish_ns);
  archive.u64(message.input_sequence);
  archive.time(message.input_stamp_ns);
  archive.time(message.input_received_ns);
  archive.f64(message.max_displacement_mm);
  archive.u32(message.step_flags);
  archive.u32_bits(message.full);
  archive.u32(message.point_count);
  archive.u32(message.moved_vertices);
  archive.check(message.base_tick <= message.tick, "the base tick is later than the tick");
  archive.u16_list(message.needles, kNeedleBytes, [&](auto& needle) { needle_fields(archive, needle); });
  const std::uint64_t points = ranges_fields(archive, message);
  assert(Archive::kReads || message.positions.size() == 3 * points);
  archive.floats(message.positions, 3 * points);

  std::vector<HeldTicks> held;
  if constexpr (!Archive::kReads) held = held_ticks(message);
  archive.sections(
      Section{number(FrameSection::kForce), forces_count(message) > 0,
              [&](auto& section) { forces_section(section, message); }},
      Section{number(FrameSection::kSeeds), message.has_seeds,
              [&](auto& section) {
                if constexpr (Archive::kReads) message.has_seeds = true;
                seeds_section(section, message);
              }},
      Section{number(FrameSection::kCertificate), message.certificate.has_value(),
              [&](auto& section) {
                if constexpr (Archive::kReads) message.certificate.emplace();
                certificate_fields(section, *message.certificate);
              }},
      Section{number(FrameSection::kPoseHistory), message.has_pose_history,
              [&](auto& section) {
                if constexpr (Archive::kReads) message.has_pose_history = true;
                poses_fields(section, message.tick, message.pose_history);
              }},
      Section{number(FrameSection::kPosesOfNeedles), !message.poses_of_needles.empty(),
              [&](auto& section) {
                section.u16_list(message.poses_of_needles, 8, [&](auto& needle) {
                  section.u16(needle.needle);
                  section.reserved(2);
                  poses_fields(section, message.tick, needle.poses);
                });
              }},
      Section{number(FrameSection::kButtons), !held.empty(),
              [&](auto& section) { buttons_section(section, held); }},
      Section{number(FrameSection::kNeedleShapes), std::ranges::any_of(message.needles, has_shape),
              [&](auto& section) { shapes_section(section, message); }},
      Section{number(FrameSection::kLag), !std::isnan(message.lag_mm),
              [&](auto& section) { section.f32(message.lag_mm); }});
  if constexpr (Archive::kReads) apply_buttons(held, message);
}

/// A FRAME is the one message large enough that its size is worth estimating.
void reserve_body(const FrameMessage& message, Bytes& out) {
  out.reserve(out.size() + 128 + kCertificateBytes + (kNeedleBytes + kForceBytes) * message.needles.size() +
              kRangeBytes * message.ranges.size() + 4 * message.positions.size() +
              kTickPoseBytes * message.pose_history.size());
}
BRACHY_CODEC(FrameMessage);

namespace {

/// The part of a TOPOLOGY that the hash covers: counts, triangles, rest positions.
void shape_fields(auto& archive, MaybeConst<TopologyMessage> auto& message) {
  assert(message.rest_vertices.size() % 3 == 0);
  archive.u32(message.surface_vertex_count);
  std::uint32_t points = static_cast<std::uint32_t>(message.rest_vertices.size() / 3);
  archive.u32(points);
  const std::uint32_t triangles = archive.u32_count(message.triangles);
  archive.reserved(4);
  archive.check(message.surface_vertex_count <= points, "there are more surface vertices than points");
  archive.items(message.triangles, triangles, kTriangleBytes, [&](auto& triangle) {
    for (auto& corner : triangle) {
      archive.u32(corner);
      archive.check(corner < message.surface_vertex_count, "a triangle names a vertex that is not there");
    }
  });
  archive.floats(message.rest_vertices, 3 * std::uint64_t{points});
}

}  // namespace

void fields(auto& archive, MaybeConst<TopologyMessage> auto& message) {
  archive.u64(message.hash);
  shape_fields(archive, message);
  archive.text(message.name, kMaxNameBytes);
  archive.sections();
}
BRACHY_CODEC(TopologyMessage);

std::uint64_t topology_hash(const TopologyMessage& message) {
  Bytes shape;
  FieldWriter archive(shape);
  shape_fields(archive, message);
  std::uint64_t hash = 0xCBF29CE484222325u;
  for (const std::byte byte : shape) hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001B3u;
  return hash;
}

}  // namespace brachy::net
