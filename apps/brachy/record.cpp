#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/brachy/client_run.h"
#include "apps/brachy/paraview_writer.h"
#include "apps/brachy/tools.h"
#include "apps/forces/force_log.h"
#include "core/error.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {
namespace {

class Recorder {
 public:
  explicit Recorder(const RecordOptions& options) : options_(options), run_(client_options(), handlers()) {
    std::error_code error;
    std::filesystem::create_directories(options.out, error);
    if (error) throw UserError(options.out.string() + ": cannot be made: " + error.message());
    for (const char* file : {"recording.pvd", "poses.csv", "forces.csv"})
      if (std::filesystem::exists(options.out / file))
        throw UserError(options.out.string() +
                        ": holds a recording already; give another folder, nothing is overwritten");
  }

  int run() {
    run_.run(options_.connect, options_.duration_s);
    poses_.flush();
    if (!poses_ && failure_.empty()) failure_ = (options_.out / "poses.csv").string() + ": cannot be written";
    attempt([&] {
      if (forces_) forces_->close();
    });
    report();
    if (failure_.empty()) failure_ = run_.failure();
    if (failure_.empty()) return kExitOk;
    std::cerr << "brachy record: " << failure_ << "\n";
    return kExitFailed;
  }

 private:
  static net::ClientOptions client_options() {
    net::ClientOptions c;
    c.name = "brachy record";
    c.subscription = net::kSubscribePoseHistory;
    return c;
  }

  net::ClientHandlers handlers() {
    net::ClientHandlers h;
    h.on_welcome = [this](const net::WelcomeMessage& welcome) {
      period_s_ = 1 / welcome.deformation_hz;
      several_ = welcome.needle_count > 1;
    };
    h.on_topology = [this](const net::TopologyMessage& t) {
      attempt([&] {
        surface_count_ = t.surface_vertex_count;
        paraview_.emplace(options_.out, t.triangles, points_of(t.rest_vertices, surface_count_),
                          surface_count_);
        poses_.open(options_.out / "poses.csv", std::ios::binary);
        poses_ << kTrajectoryHeader;
        if (several_) poses_ << ',' << kNeedleColumn;
        poses_ << "\n" << std::flush;
        forces_.emplace(options_.out / "forces.csv");
      });
    };
    h.on_frame = [this](const net::FrameMessage& frame) {
      attempt([&] {
        paraview_->add(frame.sim_time_s, points_of(run_.client().mesh().positions(), surface_count_),
                       frame.certificate);
        log_poses(frame);
        log_forces(frame);
      });
    };
    return h;
  }

  // All points, or with --surface the first ones, which are the surface's.
  std::vector<float> points_of(const std::vector<float>& positions, std::size_t surface_count) const {
    const std::size_t count = options_.surface ? 3 * surface_count : positions.size();
    return {positions.begin(), positions.begin() + static_cast<std::ptrdiff_t>(count)};
  }

  // What has been written stays; the first failure ends the recording.
  template <class F>
  void attempt(F&& write) {
    if (!failure_.empty()) return;
    try {
      write();
    } catch (const std::exception& e) {
      failure_ = e.what();
      run_.finish();
    }
  }

  // Every pose the simulation used, at its tick's time: replayed offline at the same rate they give the same ticks. A frame
  // has all ticks since the last one, of all needles, unless that is too long ago: by tick they are sorted.
  void log_poses(const net::FrameMessage& frame) {
    struct Used {
      std::uint16_t needle;
      TickPose pose;
    };
    std::vector<Used> used;
    const auto add = [&](std::uint16_t needle, const std::vector<TickPose>& history) {
      for (const TickPose& pose : history)
        if (pose.tick > last_tick_) used.push_back({needle, pose});
    };
    add(0, frame.pose_history);
    for (const net::NeedlePoses& other : frame.poses_of_needles) add(other.needle, other.poses);
    std::ranges::stable_sort(used, {}, [](const Used& u) { return u.pose.tick; });
    for (const Used& u : used) {
      const TrajectorySample sample{static_cast<double>(u.pose.tick) * period_s_, u.pose.X_WN};
      poses_ << (several_ ? trajectory_row(sample, u.needle) : trajectory_row(sample)) << "\n";
    }
    poses_written_ += used.size();
    poses_.flush();
    if (!used.empty() && last_tick_ != 0) missed_ticks_ += used.front().pose.tick - last_tick_ - 1;
    if (!used.empty()) last_tick_ = used.back().pose.tick;
  }

  // Snapshots only: what happened between two is not sent.
  void log_forces(const net::FrameMessage& frame) {
    const double det = frame.certificate ? frame.certificate->vertex_det : Certificate::kNotKnown;
    for (const net::NeedleRecord& needle : frame.needles)
      if (needle.state.present && needle.has_forces)
        forces_->add(force_sample(static_cast<double>(frame.tick) * period_s_, needle.id, needle.state, det));
    forces_->flush();
  }

  void report() const {
    const std::size_t steps = paraview_ ? paraview_->steps() : 0;
    if (options_.json) {
      const nlohmann::ordered_json json = {
          {"out", options_.out.string()},  {"snapshots", steps},
          {"poses", poses_written_},       {"forces", forces_ ? forces_->rows() : 0},
          {"ticks_missed", missed_ticks_}, {"seq_gaps", run_.client().snapshots_missed()}};
      std::cout << json.dump() << "\n";
      return;
    }
    std::cout << fmt::format(
                     "record: {} snapshots in {}/recording.pvd (ParaView), {} poses in {}/poses.csv, "
                     "{} forces in {}/forces.csv",
                     steps, options_.out.string(), poses_written_, options_.out.string(),
                     forces_ ? forces_->rows() : 0, options_.out.string())
              << (missed_ticks_ ? fmt::format("; {} ticks' poses were missed\n", missed_ticks_) : "\n");
  }

  RecordOptions options_;
  double period_s_ = 0;
  std::size_t surface_count_ = 0;
  std::optional<ParaviewWriter> paraview_;
  std::ofstream poses_;
  std::optional<ForceLogWriter> forces_;
  bool several_ = false;  // needles in the scene
  std::uint64_t last_tick_ = 0, poses_written_ = 0, missed_ticks_ = 0;
  std::string failure_;
  ClientRun run_;
};

}  // namespace

int record(const RecordOptions& options) {
  return Recorder(options).run();
}

}  // namespace brachy
