#include <algorithm>
#include <cassert>

#include "net/wire/codec.h"
#include "net/wire/force_codec.h"
#include "net/wire/sections.h"
#include "net/wire/seed_codec.h"

namespace brachy::net {
namespace {

constexpr std::uint32_t kFrameFull = 1;      // bit of the FRAME's own flags
constexpr std::size_t kNeedleBytes = 116;    // wire size of one needle record
constexpr std::size_t kTickPoseBytes = 104;  // wire size of one POSE_HISTORY entry
constexpr std::size_t kPointBytes = 12;      // three f32
constexpr std::size_t kCertificateBytes = 80;
constexpr std::size_t kForceBytes = 24 + 14 * 8;  // one entry of FORCE

void write_needle(ByteWriter& writer, const NeedleRecord& needle) {
  writer.u16(needle.id);
  writer.u8(static_cast<std::uint8_t>(needle.state.contact));
  writer.u8(needle.state.present ? 1 : 0);
  writer.u32(needle.state.landmark_count);
  writer.u32(needle.state.puncture_count);
  writer.f64(needle.state.insertion_depth_mm);
  writer.pose(needle.state.X_WN);
}

NeedleRecord read_needle(ByteReader& reader) {
  NeedleRecord needle;
  needle.id = reader.u16();
  needle.state.contact = static_cast<ContactState>(reader.u8());
  const std::uint8_t present = reader.u8();
  if (present > 1) reader.fail("a needle's present field is neither 0 nor 1");
  needle.state.present = present == 1;
  needle.state.landmark_count = reader.u32();
  needle.state.puncture_count = reader.u32();
  needle.state.insertion_depth_mm = reader.f64();
  needle.state.X_WN = reader.pose();
  return needle;
}

/// Returns how many points the ranges hold.
std::uint64_t read_ranges(ByteReader& reader, FrameMessage& message) {
  const std::uint32_t count = reader.u32();
  message.ranges.clear();
  if (reader.fits(count, 8)) message.ranges.resize(count);
  std::uint64_t points = 0;
  std::uint64_t end = 0;
  for (PointRange& range : message.ranges) {
    range.first = reader.u32();
    range.count = reader.u32();
    if (range.count == 0) reader.fail("a range is empty");
    if (range.first < end) reader.fail("the ranges are out of order or overlap");
    end = std::uint64_t{range.first} + range.count;
    if (end > message.point_count) reader.fail("a range goes past the last point");
    points += range.count;
  }
  if (message.full &&
      (message.base_tick != 0 || points != message.point_count || message.ranges.size() > 1)) {
    reader.fail("a full frame must have base tick 0 and one range with every point");
  }
  return points;
}

constexpr std::uint16_t number(FrameSection section) {
  return static_cast<std::uint16_t>(section);
}

std::size_t forces_count(const FrameMessage& message) {
  return static_cast<std::size_t>(
      std::count_if(message.needles.begin(), message.needles.end(),
                    [](const NeedleRecord& needle) { return needle.has_forces; }));
}

void write_forces(ByteWriter& writer, const FrameMessage& message) {
  const std::size_t count = forces_count(message);
  write_section_head(writer, number(FrameSection::kForce), 4 + kForceBytes * count);
  writer.u16(static_cast<std::uint16_t>(count));
  writer.u16(0);
  for (const NeedleRecord& needle : message.needles) {
    if (!needle.has_forces) continue;
    writer.u16(needle.id);
    writer.u16(0);
    writer.u32(0);
    writer.u64(needle.state.input.sequence);
    writer.time(needle.state.input.stamp_ns);
    write_needle_forces(writer, needle.state.forces);
    writer.f64(needle.state.tip_depth_mm);
  }
}

void read_forces(ByteReader& reader, FrameMessage& message) {
  const std::uint16_t count = reader.u16();
  reader.u16();
  reader.fits(count, kForceBytes);
  for (std::uint16_t i = 0; i < count && reader.ok(); ++i) {
    const std::uint16_t id = reader.u16();
    const auto needle = std::find_if(message.needles.begin(), message.needles.end(),
                                     [&](const NeedleRecord& record) { return record.id == id; });
    if (needle == message.needles.end()) return reader.fail("a force names a needle that is not there");
    reader.u16();
    reader.u32();
    needle->has_forces = true;
    needle->state.input.sequence = reader.u64();
    needle->state.input.stamp_ns = reader.time();
    needle->state.forces = read_needle_forces(reader);
    needle->state.tip_depth_mm = reader.f64();
  }
}

void write_certificate(ByteWriter& writer, const Certificate& certificate) {
  write_section_head(writer, number(FrameSection::kCertificate), kCertificateBytes);
  writer.u8(static_cast<std::uint8_t>(certificate.verdict));
  for (int reserved = 0; reserved < 3; ++reserved) writer.u8(0);
  writer.u32(certificate.substeps);
  writer.f64(certificate.det_bound);
  writer.f64(certificate.vertex_det);
  for (int axis = 0; axis < 3; ++axis) writer.f64(certificate.place(axis));
  writer.f64(certificate.margin_mm);
  writer.f64(certificate.held_mm);
  writer.f64(certificate.held_n);
  writer.f64(certificate.condition);
}

/// A verdict of a later version stays as it is, like a contact state: its name is "unknown".
Certificate read_certificate(ByteReader& reader) {
  Certificate certificate;
  certificate.verdict = static_cast<Verdict>(reader.u8());
  reader.take(3);
  certificate.substeps = reader.u32();
  certificate.det_bound = reader.f64();
  certificate.vertex_det = reader.f64();
  for (int axis = 0; axis < 3; ++axis) certificate.place(axis) = reader.f64();
  certificate.margin_mm = reader.f64();
  certificate.held_mm = reader.f64();
  certificate.held_n = reader.f64();
  certificate.condition = reader.f64();
  return certificate;
}

void write_poses(ByteWriter& writer, const std::vector<TickPose>& poses) {
  writer.u32(static_cast<std::uint32_t>(poses.size()));
  for (const TickPose& entry : poses) {
    writer.u64(entry.tick);
    writer.pose(entry.X_WN);
  }
}

void read_poses(ByteReader& reader, std::uint64_t newest_tick, std::vector<TickPose>& poses) {
  const std::uint32_t count = reader.u32();
  poses.clear();  // the section may stand there twice: the last one counts
  if (reader.fits(count, kTickPoseBytes)) poses.resize(count);
  std::uint64_t last = 0;
  for (TickPose& entry : poses) {
    entry.tick = reader.u64();
    entry.X_WN = reader.pose();
    if (entry.tick <= last || entry.tick > newest_tick) reader.fail("the pose history is out of order");
    last = entry.tick;
  }
}

void write_pose_history(ByteWriter& writer, const std::vector<TickPose>& history) {
  write_section_head(writer, number(FrameSection::kPoseHistory), 4 + kTickPoseBytes * history.size());
  write_poses(writer, history);
}

void write_poses_of_needles(ByteWriter& writer, const std::vector<NeedlePoses>& needles) {
  std::size_t length = 4;
  for (const NeedlePoses& needle : needles) length += 8 + kTickPoseBytes * needle.poses.size();
  write_section_head(writer, number(FrameSection::kPosesOfNeedles), length);
  writer.u16(static_cast<std::uint16_t>(needles.size()));
  writer.u16(0);
  for (const NeedlePoses& needle : needles) {
    writer.u16(needle.needle);
    writer.u16(0);
    write_poses(writer, needle.poses);
  }
}

void read_poses_of_needles(ByteReader& reader, FrameMessage& message) {
  const std::uint16_t count = reader.u16();
  reader.u16();
  message.poses_of_needles.clear();
  if (reader.fits(count, 8)) message.poses_of_needles.resize(count);
  for (NeedlePoses& needle : message.poses_of_needles) {
    needle.needle = reader.u16();
    reader.u16();
    read_poses(reader, message.tick, needle.poses);
  }
}

}  // namespace

void encode_body(const FrameMessage& message, Bytes& out) {
  out.reserve(out.size() + 128 + kCertificateBytes + (kNeedleBytes + kForceBytes) * message.needles.size() +
              8 * message.ranges.size() + 4 * message.positions.size() +
              kTickPoseBytes * message.pose_history.size());
  ByteWriter writer(out);
  writer.u64(message.topology_hash);
  writer.u64(message.tick);
  writer.f64(message.sim_time_s);
  writer.u64(message.snapshot_sequence);
  writer.u64(message.base_tick);
  writer.u64(message.overruns);
  writer.time(message.publish_ns);
  writer.u64(message.input_sequence);
  writer.time(message.input_stamp_ns);
  writer.time(message.input_received_ns);
  writer.f64(message.max_displacement_mm);
  writer.u32(message.step_flags);
  writer.u32(message.full ? kFrameFull : 0);
  writer.u32(message.point_count);
  writer.u32(message.moved_vertices);
  writer.u16(static_cast<std::uint16_t>(message.needles.size()));
  writer.u16(0);
  for (const NeedleRecord& needle : message.needles) write_needle(writer, needle);
  writer.u32(static_cast<std::uint32_t>(message.ranges.size()));
  [[maybe_unused]] std::size_t points = 0;
  for (const PointRange& range : message.ranges) {
    writer.u32(range.first);
    writer.u32(range.count);
    points += range.count;
  }
  assert(message.positions.size() == 3 * points);
  writer.floats(message.positions);
  const bool has_forces = forces_count(message) > 0;
  const bool has_poses = !message.poses_of_needles.empty();
  const std::vector<HeldTicks> held = held_ticks(message);
  writer.u16(static_cast<std::uint16_t>(has_forces + message.has_seeds + message.certificate.has_value() +
                                        message.has_pose_history + has_poses + !held.empty()));
  writer.u16(0);
  if (has_forces) write_forces(writer, message);
  if (message.has_seeds) write_seeds(writer, message);
  if (message.certificate) write_certificate(writer, *message.certificate);
  if (message.has_pose_history) write_pose_history(writer, message.pose_history);
  if (has_poses) write_poses_of_needles(writer, message.poses_of_needles);
  if (!held.empty()) write_buttons(writer, held);
}

DecodeResult decode_body(std::span<const std::byte> body, FrameMessage& message) {
  ByteReader reader(body);
  message.topology_hash = reader.u64();
  message.tick = reader.u64();
  message.sim_time_s = reader.f64();
  message.snapshot_sequence = reader.u64();
  message.base_tick = reader.u64();
  message.overruns = reader.u64();
  message.publish_ns = reader.time();
  message.input_sequence = reader.u64();
  message.input_stamp_ns = reader.time();
  message.input_received_ns = reader.time();
  message.max_displacement_mm = reader.f64();
  message.step_flags = reader.u32();
  message.full = (reader.u32() & kFrameFull) != 0;
  message.point_count = reader.u32();
  message.moved_vertices = reader.u32();
  if (message.base_tick > message.tick) reader.fail("the base tick is later than the tick");

  const std::uint16_t needles = reader.u16();
  reader.u16();
  message.needles.clear();
  if (reader.fits(needles, kNeedleBytes)) message.needles.resize(needles);
  for (NeedleRecord& needle : message.needles) needle = read_needle(reader);

  const std::uint64_t points = read_ranges(reader, message);
  if (reader.fits(points, kPointBytes)) reader.floats(3 * points, message.positions);

  message.certificate.reset();
  message.has_pose_history = false;
  message.pose_history.clear();
  message.poses_of_needles.clear();
  message.has_seeds = false;
  message.seed_count = 0;
  message.seeds.clear();
  std::vector<HeldTicks> held;
  read_sections(reader, [&](std::uint16_t id, std::span<const std::byte> payload) {
    ByteReader section(payload);
    switch (static_cast<FrameSection>(id)) {
      case FrameSection::kForce:
        read_forces(section, message);
        break;
      case FrameSection::kSeeds:
        message.has_seeds = true;
        read_seeds(section, message);
        break;
      case FrameSection::kCertificate:
        message.certificate = read_certificate(section);
        break;
      case FrameSection::kPoseHistory:
        message.has_pose_history = true;
        read_poses(section, message.tick, message.pose_history);
        break;
      case FrameSection::kPosesOfNeedles:
        read_poses_of_needles(section, message);
        break;
      case FrameSection::kButtons:
        held = read_buttons(section);
        break;
      default:
        return;  // of a later version
    }
    if (const std::string_view reason = section.finish(); !reason.empty()) reader.fail(reason);
  });
  apply_buttons(held, message);
  return DecodeResult::of(reader);
}

namespace {

/// The part of a TOPOLOGY that the hash covers: counts, triangles, rest positions.
void write_shape(ByteWriter& writer, const TopologyMessage& message) {
  assert(message.rest_vertices.size() % 3 == 0);
  writer.u32(message.surface_vertex_count);
  writer.u32(static_cast<std::uint32_t>(message.rest_vertices.size() / 3));
  writer.u32(static_cast<std::uint32_t>(message.triangles.size()));
  writer.u32(0);
  for (const Triangle& triangle : message.triangles) {
    for (const std::uint32_t corner : triangle) writer.u32(corner);
  }
  writer.floats(message.rest_vertices);
}

}  // namespace

void encode_body(const TopologyMessage& message, Bytes& out) {
  ByteWriter writer(out);
  writer.u64(message.hash);
  write_shape(writer, message);
  writer.text(message.name, kMaxNameBytes);
  write_no_sections(writer);
}

DecodeResult decode_body(std::span<const std::byte> body, TopologyMessage& message) {
  ByteReader reader(body);
  message.hash = reader.u64();
  message.surface_vertex_count = reader.u32();
  const std::uint32_t points = reader.u32();
  const std::uint32_t triangles = reader.u32();
  reader.u32();
  if (message.surface_vertex_count > points) reader.fail("there are more surface vertices than points");
  message.triangles.clear();
  if (reader.fits(triangles, 12)) message.triangles.resize(triangles);
  for (Triangle& triangle : message.triangles) {
    for (std::uint32_t& corner : triangle) {
      corner = reader.u32();
      if (corner >= message.surface_vertex_count) reader.fail("a triangle names a vertex that is not there");
    }
  }
  message.rest_vertices.clear();
  if (reader.fits(points, kPointBytes)) reader.floats(3 * std::size_t{points}, message.rest_vertices);
  message.name = reader.text(kMaxNameBytes);
  skip_sections(reader);
  return DecodeResult::of(reader);
}

std::uint64_t topology_hash(const TopologyMessage& message) {
  Bytes shape;
  ByteWriter writer(shape);
  write_shape(writer, message);
  std::uint64_t hash = 0xCBF29CE484222325u;
  for (const std::byte byte : shape) hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001B3u;
  return hash;
}

}  // namespace brachy::net
