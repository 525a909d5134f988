#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "apps/recording/recording_file.h"
#include "net/wire/codec.h"

namespace brachy::test {

/// Messages of a server with a mesh of three points, numbered and stamped as it would.
class SampleMessages {
 public:
  struct Message {
    net::Header header;
    net::Bytes body;
  };

  SampleMessages() {
    net::WelcomeMessage welcome;
    welcome.deformation_hz = 200;
    welcome.needle_count = 2;
    welcome.server = "a server";
    add(welcome);
    topology_.surface_vertex_count = 3;
    topology_.triangles = {{0, 1, 2}};
    topology_.rest_vertices = {0, 0, 0, 10, 0, 0, 0, 10, 0};
    topology_.hash = net::topology_hash(topology_);
    add(topology_);
  }

  template <class M>
  void add(const M& message) {
    Message& added = messages_.emplace_back();
    net::encode_body(message, added.body);
    stamp_ns_ += 10'000'000;
    added.header = {net::kProtocolVersion, M::kType, 0, static_cast<std::uint32_t>(added.body.size()),
                    messages_.size(),      stamp_ns_};
  }
  void add(net::Header header, net::Bytes body) { messages_.push_back({header, std::move(body)}); }

  /// A FRAME of `tick` with all points, and needle 0's poses of the ticks `poses`.
  net::FrameMessage frame(std::uint64_t tick, const std::vector<std::uint64_t>& poses) {
    net::FrameMessage frame;
    frame.topology_hash = topology_.hash;
    frame.tick = tick;
    frame.sim_time_s = 0.005 * static_cast<double>(tick);
    frame.snapshot_sequence = ++snapshots_;
    frame.full = true;
    frame.point_count = 3;
    frame.ranges = {{0, 3}};
    frame.positions = topology_.rest_vertices;
    frame.positions[2] = static_cast<float>(tick);
    frame.needles.resize(1);
    frame.needles[0].state.present = !poses.empty();
    frame.has_pose_history = true;
    for (const std::uint64_t at : poses) frame.pose_history.push_back(pose(at));
    return frame;
  }
  static TickPose pose(std::uint64_t tick) {
    return {tick, {Mat3::Identity(), Vec3(0.1 * static_cast<double>(tick), 1.0 / 3, 0)}, tick % 2 == 0};
  }

  const std::vector<Message>& all() const { return messages_; }
  void write(const std::filesystem::path& file) const {
    RecordingWriter writer(file);
    for (const Message& m : messages_) writer.add(m.header, m.body);
  }

 private:
  net::TopologyMessage topology_;
  std::vector<Message> messages_;
  std::int64_t stamp_ns_ = 1'000'000'000;
  std::uint64_t snapshots_ = 0;
};

}  // namespace brachy::test
