#include "net/wire/frame_encoder.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>

#include "net/wire/codec.h"

namespace brachy::net {
namespace {

std::vector<PointRange> changed_ranges(const MeshState& state, const std::vector<Block>& blocks,
                                       std::uint64_t after_tick) {
  std::vector<PointRange> ranges;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (state.mesh.block_ticks[b] <= after_tick || blocks[b].count == 0) continue;
    if (!ranges.empty() && ranges.back().first + ranges.back().count == blocks[b].first) {
      ranges.back().count += blocks[b].count;
    } else {
      ranges.push_back({blocks[b].first, blocks[b].count});
    }
  }
  return ranges;
}

/// The poses of ticks after_tick + 1 to state.summary.tick that the ring still holds.
std::vector<TickPose> poses_after(const MeshState& state, std::size_t needle, std::uint64_t after_tick) {
  constexpr std::uint64_t kRing = NeedleStates::kPoseHistory;
  const std::uint64_t last = state.summary.tick;
  std::vector<TickPose> poses;
  if (needle >= state.needles.pose_histories.size()) return poses;
  const std::uint64_t oldest = last >= kRing ? last - kRing + 1 : 1;
  for (std::uint64_t tick = std::max(after_tick + 1, oldest); tick <= last; ++tick) {
    const TickPose& pose = state.needles.pose_histories[needle][tick % kRing];
    if (pose.tick == tick) poses.push_back(pose);
  }
  return poses;
}

NeedlePose last_arrived(const MeshState& state) {
  const std::vector<NeedleState>& needles = state.needles.states;
  const auto newest = std::max_element(
      needles.begin(), needles.end(),
      [](const NeedleState& a, const NeedleState& b) { return a.input.received_ns < b.input.received_ns; });
  return newest == needles.end() ? NeedlePose{} : newest->input;
}

}  // namespace

TopologyMessage make_topology(const Tissue& tissue, const std::string& name, bool surface) {
  TopologyMessage topology;
  topology.surface_vertex_count = static_cast<std::uint32_t>(tissue.surface_count);
  topology.triangles = tissue.triangles;
  const std::span points(tissue.rest_vertices.data(), surface ? tissue.surface_count : tissue.size());
  topology.rest_vertices.reserve(3 * points.size());
  for (const Vec3& p : points) {
    for (int axis = 0; axis < 3; ++axis) topology.rest_vertices.push_back(static_cast<float>(p[axis]));
  }
  topology.name = name;
  topology.hash = topology_hash(topology);
  return topology;
}

FrameLayout make_layout(const Tissue& tissue, const TopologyMessage& topology) {
  FrameLayout layout{{}, static_cast<std::uint32_t>(topology.rest_vertices.size() / 3), topology.hash};
  for (const Block& block : tissue.blocks)
    if (block.first < layout.point_count)
      layout.blocks.push_back(block);  // no block crosses the surface's end
  return layout;
}

void encode_frame(const MeshState& state, const FrameLayout& layout, std::uint64_t snapshot_sequence,
                  const FrameRequest& request, Bytes& out) {
  const TickSummary& summary = state.summary;
  const std::vector<NeedleState>& needles = state.needles.states;
  assert(state.mesh.block_ticks.size() >= layout.blocks.size());
  assert(state.mesh.deformed_vertices.size() >= 3 * std::size_t{layout.point_count});
  assert(request.after_tick <= summary.tick);
  FrameMessage frame;
  frame.topology_hash = layout.topology_hash;
  frame.tick = summary.tick;
  frame.sim_time_s = summary.sim_time_s;
  frame.snapshot_sequence = snapshot_sequence;
  frame.base_tick = request.full ? 0 : request.after_tick;
  frame.overruns = summary.overruns;
  frame.publish_ns = summary.publish_ns;
  const NeedlePose input = last_arrived(state);
  frame.input_sequence = input.sequence;
  frame.input_stamp_ns = input.stamp_ns;
  frame.input_received_ns = input.received_ns;
  frame.max_displacement_mm = summary.max_displacement_mm;
  frame.step_flags = summary.step_flags;
  frame.full = request.full;
  frame.point_count = layout.point_count;
  frame.moved_vertices = summary.moved_vertices;
  for (std::size_t n = 0; n < needles.size(); ++n) {
    const NeedleState& needle = needles[n];
    frame.needles.push_back({static_cast<std::uint16_t>(n), needle, needle.forces.is_finite()});
    NeedleShape& shape = frame.needles.back().state.shape;
    shape.is_bent = shape.is_bent && shape.is_finite();
  }
  if (!request.full) {
    frame.ranges = changed_ranges(state, layout.blocks, request.after_tick);
  } else if (frame.point_count > 0) {
    frame.ranges.push_back({0, frame.point_count});
  }
  for (const PointRange& range : frame.ranges) {
    assert(std::uint64_t{range.first} + range.count <= frame.point_count);
    const float* first = state.mesh.deformed_vertices.data() + 3 * std::size_t{range.first};
    frame.positions.insert(frame.positions.end(), first, first + 3 * std::size_t{range.count});
  }
  frame.certificate = summary.certificate;
  frame.lag_mm = summary.lag_mm;
  frame.has_pose_history = request.pose_history;
  if (request.pose_history) {
    frame.pose_history = poses_after(state, 0, request.after_tick);
    for (std::size_t n = 1; n < needles.size(); ++n)
      frame.poses_of_needles.push_back(
          {static_cast<std::uint16_t>(n), poses_after(state, n, request.after_tick)});
  }
  frame.seed_count = state.seeds.count;
  frame.has_seeds = state.seeds.count > 0;
  for (std::size_t i = 0; i < state.seeds.count; ++i)
    if (request.full || state.seeds.ticks[i] > request.after_tick)
      frame.seeds.push_back(state.seeds.slots[i]);
  encode_body(frame, out);
}

}  // namespace brachy::net
