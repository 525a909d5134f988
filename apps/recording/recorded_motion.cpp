#include "apps/recording/recorded_motion.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "apps/recording/read_recording.h"
#include "core/base/error.h"
#include "haptics/trajectory/rigid_pose.h"

namespace brachy {
namespace {

class MotionReader {
 public:
  MotionReader(const std::filesystem::path& file, ReplayedModel model, std::size_t needle_count)
      : reader_(file),
        name_(file.string()),
        model_(model),
        needle_count_(needle_count),
        messages_(handlers()) {}

  RecordedMotion read() {
    read_recording(reader_, messages_);
    std::vector<NeedleTrajectories::Needle> needles;
    for (std::uint32_t id = 0; id < samples_.size(); ++id)
      if (!samples_[id].empty()) needles.push_back({id, Trajectory(std::move(samples_[id]))});
    if (needles.empty()) throw UserError(name_ + ": no needle moves in it, so there is nothing to replay");
    if (ticks_missed_)
      remarks_.push_back(fmt::format("{} ticks' poses were missed when it was recorded", ticks_missed_));
    if (!reader_.damage().empty()) remarks_.push_back(reader_.damage());
    return {NeedleTrajectories(std::move(needles)), std::move(remarks_)};
  }

 private:
  net::MessageHandlers handlers() {
    net::MessageHandlers h;
    h.on_welcome = [this](const net::WelcomeMessage& welcome) {
      period_s_ = 1 / welcome.deformation_hz;
      if (!(std::isfinite(period_s_) && period_s_ > 0))
        throw UserError(name_ + ": its WELCOME has no tick rate; it cannot be replayed");
    };
    h.on_event = [this](const net::EventMessage& event) { starts_.add(event); };
    h.on_state = [this](const net::StateMessage& state) {
      if (models_.is_another(state) && model_ == ReplayedModel::kRecorded)
        cannot_follow(state.ticks, "another model was chosen");
    };
    h.on_frame = [this](const net::FrameMessage& frame) { take(frame); };
    return h;
  }

  [[noreturn]] void cannot_follow(std::uint64_t tick, const std::string& what) const {
    throw UserError(fmt::format(
        "{}: {} at tick {}, which a replay cannot follow; `brachy export` has the poses of each part", name_,
        what, tick));
  }

  void take(const net::FrameMessage& frame) {
    if (starts_.is_first_of_a_run(frame)) cannot_follow(frame.tick, "the simulation was reset");
    if (frames_++ == 0) check_start(frame);
    const std::uint64_t before = last_tick_;
    for (const TickPose& pose : frame.pose_history) add(0, pose, before);
    for (const net::NeedlePoses& other : frame.poses_of_needles)
      for (const TickPose& pose : other.poses) add(other.needle, pose, before);
    for (const net::NeedleRecord& needle : frame.needles)
      if (needle.id < samples_.size() && !needle.state.present && !samples_[needle.id].empty() && !removed_)
        removed_ = Removed{needle.id, frame.tick};
  }

  void check_start(const net::FrameMessage& frame) {
    for (const net::NeedleRecord& needle : frame.needles)
      if (needle.state.present && (needle.state.contact != ContactState::kFree || frame.seed_count > 0)) {
        remarks_.push_back("it began when needles had already moved: a replay begins at rest");
        return;
      }
  }

  void add(std::uint32_t id, const TickPose& pose, std::uint64_t before) {
    if (pose.tick <= before) return;
    if (id >= needle_count_)
      throw UserError(
          fmt::format("{}: moves needle {}, and the scene has {} from 0 on; raise needle.count in the scene "
                      "to {} or more",
                      name_, id, needle_count_, id + 1));
    if (removed_) cannot_follow(removed_->tick, fmt::format("needle {} was removed", removed_->needle));
    auto& own = samples_[id];
    TrajectorySample sample{static_cast<double>(pose.tick) * period_s_, pose.X_WN, pose.button};
    if (!own.empty() && !(sample.t_s > own.back().t_s)) return;
    if (find_defect(sample.X_WN) != PoseDefect::kNone)
      throw UserError(fmt::format("{}: the pose of tick {} is not rigid", name_, pose.tick));
    make_rigid(sample.X_WN);
    if (++count_ > kMaxTrajectorySamples)
      throw UserError(
          fmt::format("{}: has more than {} poses, too many to replay", name_, kMaxTrajectorySamples));
    own.push_back(sample);
    if (last_tick_ != 0 && pose.tick > last_tick_ + 1) ticks_missed_ += pose.tick - last_tick_ - 1;
    last_tick_ = std::max(last_tick_, pose.tick);
  }

  struct Removed {
    std::uint32_t needle;
    std::uint64_t tick;
  };

  RecordingReader reader_;
  const std::string name_;
  const ReplayedModel model_;
  const std::size_t needle_count_;
  std::array<std::vector<TrajectorySample>, kMaxTrajectoryNeedles> samples_;
  double period_s_ = 0;
  RunStarts starts_;
  ModelChanges models_;
  std::uint64_t frames_ = 0, last_tick_ = 0, ticks_missed_ = 0;
  std::size_t count_ = 0;
  std::optional<Removed> removed_;
  std::vector<std::string> remarks_;
  net::ServerMessages messages_;
};

}  // namespace

RecordedMotion load_recorded_motion(const std::filesystem::path& file, ReplayedModel model,
                                    std::size_t needle_count) {
  return MotionReader(file, model, std::min(needle_count, kMaxTrajectoryNeedles)).read();
}

}  // namespace brachy
