#include "apps/recording/recording_tally.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/reports/certificate_report.h"

namespace brachy {
namespace {

constexpr std::pair<net::MessageType, const char*> kCounted[] = {
    {net::MessageType::kFrame, "frames"}, {net::MessageType::kState, "states"},
    {net::MessageType::kEvent, "events"}, {net::MessageType::kDose, "doses"},
    {net::MessageType::kError, "errors"},
};

}  // namespace

net::MessageHandlers RecordingTally::handlers() {
  net::MessageHandlers h;
  h.on_message = [this](const net::Header& header, std::span<const std::byte>) {
    ++messages_[header.type];
    stamp_ns_ = header.stamp_ns;
  };
  h.on_welcome = [this](const net::WelcomeMessage& welcome) { welcome_ = welcome; };
  h.on_topology = [this](const net::TopologyMessage& topology) {
    topology_.hash = topology.hash;
    topology_.name = topology.name;
    topology_.surface_vertex_count = topology.surface_vertex_count;
    points_ = topology.rest_vertices.size() / 3;
    triangles_ = topology.triangles.size();
  };
  h.on_frame = [this](const net::FrameMessage& frame) { add(frame); };
  h.on_state = [this](const net::StateMessage& state) { model_changes_ += models_.is_another(state); };
  h.on_event = [this](const net::EventMessage& event) { starts_.add(event); };
  h.on_dose = [this](const net::DoseMessage& dose) { dose_ = dose; };
  return h;
}

void RecordingTally::add(const net::FrameMessage& frame) {
  if (frames() == 1) {
    first_ns_ = stamp_ns_;
    first_tick_ = frame.tick;
    first_overruns_ = frame.overruns;
  } else {
    longest_gap_ns_ = std::max(longest_gap_ns_, stamp_ns_ - last_ns_);
    if (frame.snapshot_sequence > last_snapshot_)
      snapshots_missed_ += frame.snapshot_sequence - last_snapshot_ - 1;
  }
  if (starts_.is_first_of_a_run(frame)) {
    ++resets_;
    last_pose_tick_ = 0;
  }
  last_ns_ = stamp_ns_;
  last_tick_ = frame.tick;
  last_snapshot_ = frame.snapshot_sequence;
  overruns_ = frame.overruns;
  full_frames_ += frame.full;
  seeds_ = frame.seed_count;
  max_displacement_mm_ = std::max(max_displacement_mm_, frame.max_displacement_mm);
  for (const net::NeedleRecord& needle : frame.needles) {
    if (!needle.state.present) continue;
    max_depth_mm_ = std::max(max_depth_mm_, needle.state.insertion_depth_mm);
    max_tip_deflection_mm_ = std::max(max_tip_deflection_mm_, needle.state.shape.tip_deflection_mm());
  }
  certificates_.add(frame.certificate, frame.step_flags, frame.lag_mm, all_finite(frame.positions));
  add_poses(frame);
}

// As a session's log counts them: of a tick that some needle's pose is known of.
void RecordingTally::add_poses(const net::FrameMessage& frame) {
  std::uint64_t first = 0, last = 0;
  const auto take = [&](const std::vector<TickPose>& poses) {
    for (const TickPose& pose : poses) {
      if (pose.tick <= last_pose_tick_) continue;
      ++poses_;
      first = first == 0 ? pose.tick : std::min(first, pose.tick);
      last = std::max(last, pose.tick);
    }
  };
  take(frame.pose_history);
  for (const net::NeedlePoses& other : frame.poses_of_needles) take(other.poses);
  if (last == 0) return;
  if (last_pose_tick_ != 0) ticks_missed_ += first - last_pose_tick_ - 1;
  last_pose_tick_ = last;
}

std::uint64_t RecordingTally::count(net::MessageType type) const {
  const auto found = messages_.find(type);
  return found == messages_.end() ? 0 : found->second;
}

std::string RecordingTally::to_json(std::uint64_t bytes, const std::string& damage) const {
  nlohmann::ordered_json json = {
      {"bytes", bytes},
      {"server", welcome_.server},
      {"duration_s", duration_s()},
      {"frames_hz", frames_hz()},
      {"longest_gap_s", 1e-9 * static_cast<double>(longest_gap_ns_)},
      {"bytes_per_minute", bytes_per_minute(bytes)},
      {"deformation_hz", welcome_.deformation_hz},
      {"snapshot_hz", welcome_.snapshot_hz},
      {"needles", welcome_.needle_count},
      {"topology", fmt::format("{:016x}", topology_.hash)},
      {"name", topology_.name},
      {"points", points_},
      {"surface_vertices", topology_.surface_vertex_count},
      {"triangles", triangles_},
      {"scene", count(net::MessageType::kScene) > 0},
      {"kernel", models_.model().kernel},
      {"support_radius_mm", models_.model().support_radius_mm},
      {"model_changes", model_changes_},
      {"resets", resets_},
      {"first_tick", first_tick_},
      {"last_tick", last_tick_},
      {"overruns", overruns_ - std::min(first_overruns_, overruns_)},
  };
  for (const auto& [type, name] : kCounted) json[name] = count(type);
  json["full_frames"] = full_frames_;
  json["seq_gaps"] = snapshots_missed_;
  json["poses"] = poses_;
  json["ticks_missed"] = ticks_missed_;
  json["seeds"] = seeds_;
  if (!dose_.structures.empty()) {
    json["dose_seeds"] = dose_.seeds;
    json["v100_percent"] = dose_.structures.front().v100_percent;
    json["d90_gy"] = dose_.structures.front().d90_gy;
  }
  json["max_disp_mm"] = max_displacement_mm_;
  json["max_depth_mm"] = max_depth_mm_;
  add_to_json(json, "frames", certificates_);
  json["damage"] = damage.empty() ? nlohmann::json() : nlohmann::json(damage);
  json["max_tip_deflection_mm"] = max_tip_deflection_mm_;
  return json.dump() + "\n";
}

std::string RecordingTally::to_text(std::uint64_t bytes, const std::string& damage) const {
  std::string text = fmt::format(
      "  {:.1f} s by {}, {:.1f} MB ({:.1f} MB a minute)\n"
      "  {} frames at {:.1f} Hz, {} of them full, longest gap {:.3f} s, {} missed; {} states, {} events, {} "
      "errors\n"
      "  ticks {} to {} at {:g} Hz, {} deadlines missed; {} needle(s), {} poses, {} ticks' poses missed\n"
      "  {} points ({} of the surface), {} triangles, topology {:016x}{}\n",
      duration_s(), welcome_.server.empty() ? "a server without a name" : welcome_.server,
      1e-6 * static_cast<double>(bytes), 1e-6 * bytes_per_minute(bytes), frames(), frames_hz(), full_frames_,
      1e-9 * static_cast<double>(longest_gap_ns_), snapshots_missed_, count(net::MessageType::kState),
      events(), count(net::MessageType::kError), first_tick_, last_tick_, welcome_.deformation_hz,
      overruns_ - std::min(first_overruns_, overruns_), welcome_.needle_count, poses_, ticks_missed_, points_,
      topology_.surface_vertex_count, triangles_, topology_.hash,
      count(net::MessageType::kScene) > 0 ? ", with its scene" : "");
  const net::ControlsState& model = models_.model();
  if (!model.kernel.empty())
    text += fmt::format("  model {}, support {:g} mm{}\n", model.kernel, model.support_radius_mm,
                        model_changes_ ? fmt::format(", the last of {}", model_changes_ + 1) : "");
  if (resets_) text += fmt::format("  reset {} time(s): what follows is another run\n", resets_);
  text += fmt::format("  deepest insertion {:.1f} mm, largest displacement {:.2f} mm, {} seeds in the end\n",
                      max_depth_mm_, max_displacement_mm_, seeds_);
  if (max_tip_deflection_mm_ > 0)
    text += fmt::format("  needles bend: tip deflected by at most {:.2f} mm\n", max_tip_deflection_mm_);
  if (!dose_.structures.empty())
    text += fmt::format("  dose of {} seeds: {} V100 {:.1f} %, D90 {:.1f} Gy\n", dose_.seeds,
                        dose_.structures.front().name, dose_.structures.front().v100_percent,
                        dose_.structures.front().d90_gy);
  text += brachy::to_text("frames", certificates_);
  return damage.empty() ? text : text + "  DAMAGED: " + damage + "\n";
}

}  // namespace brachy
