#include "net/broker/relayed_mesh.h"

#include <algorithm>
#include <cassert>
#include <cstring>

namespace brachy::net {
namespace {

/// Blocks as build_tissue makes them: a viewer of the relay gets the same ranges as a viewer of the daemon.
void add_blocks(Tissue& tissue, std::size_t first, std::size_t last) {
  for (; first < last; first += Tissue::kBlockSize) {
    const std::size_t count = std::min(Tissue::kBlockSize, last - first);
    tissue.blocks.push_back(
        {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(count), Vec3::Zero(), Vec3::Zero()});
  }
}

/// A stamp of the daemon's clock converted to ours; unchanged where there is none.
std::int64_t on_our_clock(std::int64_t stamp_ns, std::int64_t clock_offset_ns) {
  std::int64_t sum = 0;
  return __builtin_add_overflow(stamp_ns, clock_offset_ns, &sum) ? stamp_ns : sum;
}

Tissue tissue_of(const TopologyMessage& topology) {
  Tissue tissue;
  tissue.surface_count = topology.surface_vertex_count;
  const auto& at = topology.rest_vertices;
  for (std::size_t i = 0; i + 2 < at.size(); i += 3)
    tissue.rest_vertices.push_back(Vec3(at[i], at[i + 1], at[i + 2]));
  tissue.triangles = topology.triangles;
  add_blocks(tissue, 0, tissue.surface_count);
  add_blocks(tissue, tissue.surface_count, tissue.size());
  return tissue;
}

}  // namespace

RelayedMesh::RelayedMesh(const TopologyMessage& topology, std::size_t needles)
    : topology_hash_(topology.hash), tissue_(tissue_of(topology)) {
  state_.mesh.deformed_vertices = topology.rest_vertices;
  state_.mesh.block_ticks.resize(tissue_.blocks.size());
  state_.needles.states.resize(needles);
  state_.needles.pose_histories.resize(needles);
}

void RelayedMesh::take(const FrameMessage& frame, std::int64_t clock_offset_ns) {
  // Only a simulation that was reset goes back in time, or loses seeds.
  if (frame.tick < state_.summary.tick || frame.seed_count < state_.seeds.count) restart_from_full_frame();
  TickSummary& summary = state_.summary;
  summary.tick = frame.tick;
  summary.sim_time_s = frame.sim_time_s;
  summary.overruns = frame.overruns;
  summary.publish_ns = on_our_clock(frame.publish_ns, clock_offset_ns);
  summary.step_flags = frame.step_flags;
  summary.max_displacement_mm = frame.max_displacement_mm;
  summary.moved_vertices = frame.moved_vertices;
  summary.certificate = frame.certificate.value_or(Certificate{});
  summary.lag_mm = frame.lag_mm;
  take_points(frame);
  take_needles(frame, clock_offset_ns);
  take_poses(0, frame.pose_history);
  for (const NeedlePoses& needle : frame.poses_of_needles) take_poses(needle.needle, needle.poses);
  take_seeds(frame);
}

// The server sends every client everything when `run` changes.
void RelayedMesh::restart_from_full_frame() {
  ++state_.summary.run;
  std::ranges::fill(state_.mesh.block_ticks, 0);
  for (auto& history : state_.needles.pose_histories) history = {};
  state_.seeds.count = 0;
}

void RelayedMesh::take_points(const FrameMessage& frame) {
  const float* from = frame.positions.data();
  auto block = tissue_.blocks.begin();
  for (const PointRange& range : frame.ranges) {
    assert(std::uint64_t{range.first} + range.count <= tissue_.size());
    const std::uint32_t end = range.first + range.count;
    while (block->first + block->count <= range.first) ++block;
    // A range may hold several blocks, and end within one.
    for (std::uint32_t point = range.first; point < end;) {
      const std::uint32_t until = std::min(end, block->first + block->count);
      const std::size_t floats = 3 * std::size_t{until - point};
      float* to = state_.mesh.deformed_vertices.data() + 3 * std::size_t{point};
      if (std::memcmp(to, from, floats * sizeof(float)) != 0) {
        std::copy_n(from, floats, to);
        state_.mesh.block_ticks[static_cast<std::size_t>(block - tissue_.blocks.begin())] = frame.tick;
      }
      from += floats;
      point = until;
      if (point < end) ++block;
    }
  }
}

void RelayedMesh::take_needles(const FrameMessage& frame, std::int64_t clock_offset_ns) {
  for (NeedleState& needle : state_.needles.states) {
    needle = {};
    needle.forces.axial_n = Certificate::kNotKnown;
  }
  // The needle whose pose arrived last is found by its sequence and stamp; without forces it is not known.
  bool is_told = frame.input_sequence == 0;
  for (const NeedleRecord& record : frame.needles) {
    if (record.id >= state_.needles.states.size()) continue;
    NeedleState& needle = state_.needles.states[record.id];
    needle = record.state;
    if (!record.has_forces) {
      needle.forces.axial_n = Certificate::kNotKnown;
      if (is_told) continue;
      needle.input.sequence = frame.input_sequence;
      needle.input.stamp_ns = frame.input_stamp_ns;
    }
    if (is_told || needle.input.sequence != frame.input_sequence ||
        needle.input.stamp_ns != frame.input_stamp_ns)
      continue;
    is_told = true;
    needle.input.received_ns = on_our_clock(frame.input_received_ns, clock_offset_ns);
  }
}

void RelayedMesh::take_poses(std::size_t needle, const std::vector<TickPose>& poses) {
  if (needle >= state_.needles.pose_histories.size()) return;
  for (const TickPose& pose : poses)
    state_.needles.pose_histories[needle][pose.tick % NeedleStates::kPoseHistory] = pose;
}

void RelayedMesh::take_seeds(const FrameMessage& frame) {
  if (!frame.has_seeds) return;
  state_.seeds.count = frame.seed_count;
  state_.seeds.slots.resize(frame.seed_count);
  state_.seeds.ticks.resize(frame.seed_count);
  for (const Seed& seed : frame.seeds) {
    state_.seeds.slots[seed.id - 1] = seed;
    state_.seeds.ticks[seed.id - 1] = frame.tick;
  }
}

}  // namespace brachy::net
