#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "apps/recording/read_recording.h"
#include "apps/reports/certificate_tally.h"

namespace brachy {

/// Totals over the messages of a recording: of a file (`brachy inspect`) or of one being made (`brachy record`).
class RecordingTally {
 public:
  /// For ServerMessages, which also keeps the mesh. Valid as long as this is.
  net::MessageHandlers handlers();

  std::uint64_t frames() const { return count(net::MessageType::kFrame); }
  std::uint64_t events() const { return count(net::MessageType::kEvent); }
  std::uint64_t poses() const { return poses_; }
  std::uint64_t ticks_missed() const { return ticks_missed_; }
  std::uint32_t seeds() const { return seeds_; }
  /// From the first FRAME's stamp to the last one's.
  double duration_s() const { return 1e-9 * static_cast<double>(last_ns_ - first_ns_); }

  /// Readable text of several lines; JSON on one line. `bytes`: of the file; `damage`: RecordingReader::damage().
  std::string to_text(std::uint64_t bytes, const std::string& damage) const;
  std::string to_json(std::uint64_t bytes, const std::string& damage) const;

 private:
  void add(const net::FrameMessage& frame);
  void add_poses(const net::FrameMessage& frame);
  std::uint64_t count(net::MessageType type) const;
  double frames_hz() const { return duration_s() > 0 ? static_cast<double>(frames() - 1) / duration_s() : 0; }
  double bytes_per_minute(std::uint64_t bytes) const {
    return duration_s() > 0 ? 60 * static_cast<double>(bytes) / duration_s() : 0;
  }

  net::WelcomeMessage welcome_;
  net::TopologyMessage topology_;  // without points and triangles
  std::size_t points_ = 0, triangles_ = 0;
  std::map<net::MessageType, std::uint64_t> messages_;
  std::int64_t stamp_ns_ = 0;  // of the current message
  std::int64_t first_ns_ = 0, last_ns_ = 0, longest_gap_ns_ = 0;
  std::uint64_t first_tick_ = 0, last_tick_ = 0, last_pose_tick_ = 0;
  std::uint64_t full_frames_ = 0, poses_ = 0, ticks_missed_ = 0, last_snapshot_ = 0, snapshots_missed_ = 0;
  std::uint64_t first_overruns_ = 0, overruns_ = 0, resets_ = 0, model_changes_ = 0;
  double max_displacement_mm_ = 0, max_depth_mm_ = 0, max_tip_deflection_mm_ = 0;
  std::uint32_t seeds_ = 0;
  CertificateTally certificates_;
  RunStarts starts_;
  ModelChanges models_;
  net::DoseMessage dose_;  // the newest
};

}  // namespace brachy
