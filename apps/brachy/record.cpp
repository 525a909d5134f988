#include <fmt/format.h>

#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/brachy/client_run.h"
#include "apps/brachy/paraview_writer.h"
#include "apps/brachy/tools.h"
#include "core/error.h"
#include "haptics/trajectory.h"

namespace brachy {
namespace {

class Recorder {
 public:
  explicit Recorder(const RecordOptions& options) : options_(options), run_(client_options(), handlers()) {
    std::error_code error;
    std::filesystem::create_directories(options.out, error);
    if (error) throw UserError(options.out.string() + ": cannot be made: " + error.message());
    for (const char* file : {"recording.pvd", "poses.csv"})
      if (std::filesystem::exists(options.out / file))
        throw UserError(options.out.string() +
                        ": holds a recording already; give another folder, nothing is overwritten");
  }

  int run() {
    run_.run(options_.connect, options_.duration_s);
    poses_.flush();
    if (!poses_ && failure_.empty()) failure_ = (options_.out / "poses.csv").string() + ": cannot be written";
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
    h.on_welcome = [this](const net::WelcomeMessage& welcome) { period_s_ = 1 / welcome.deformation_hz; };
    h.on_topology = [this](const net::TopologyMessage& t) {
      attempt([&] {
        surface_count_ = t.surface_vertex_count;
        paraview_.emplace(options_.out, t.triangles, points_of(t.rest_vertices, surface_count_),
                          surface_count_);
        poses_.open(options_.out / "poses.csv", std::ios::binary);
        poses_ << kTrajectoryHeader << "\n" << std::flush;
      });
    };
    h.on_frame = [this](const net::FrameMessage& frame) {
      attempt([&] {
        paraview_->add(frame.sim_time_s, points_of(run_.client().mesh().positions(), surface_count_),
                       frame.certificate);
        log_poses(frame);
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

  // Every pose the simulation used, at its tick's time: replayed offline at the same rate they give the same ticks.
  void log_poses(const net::FrameMessage& frame) {
    if (frame.needles.empty() || !frame.needles[0].state.present) return;
    for (const TickPose& pose : frame.pose_history) {
      if (pose.tick <= last_tick_) continue;
      if (last_tick_ != 0) missed_ticks_ += pose.tick - last_tick_ - 1;
      last_tick_ = pose.tick;
      poses_ << trajectory_row({static_cast<double>(pose.tick) * period_s_, pose.X_WN}) << "\n";
      ++poses_written_;
    }
    poses_.flush();
  }

  void report() const {
    const std::size_t steps = paraview_ ? paraview_->steps() : 0;
    if (options_.json) {
      const nlohmann::ordered_json json = {{"out", options_.out.string()},
                                           {"snapshots", steps},
                                           {"poses", poses_written_},
                                           {"ticks_missed", missed_ticks_},
                                           {"seq_gaps", run_.client().snapshots_missed()}};
      std::cout << json.dump() << "\n";
      return;
    }
    std::cout << fmt::format("record: {} snapshots in {}/recording.pvd (ParaView), {} poses in {}/poses.csv",
                             steps, options_.out.string(), poses_written_, options_.out.string())
              << (missed_ticks_ ? fmt::format("; {} ticks' poses were missed\n", missed_ticks_) : "\n");
  }

  RecordOptions options_;
  double period_s_ = 0;
  std::size_t surface_count_ = 0;
  std::optional<ParaviewWriter> paraview_;
  std::ofstream poses_;
  std::uint64_t last_tick_ = 0, poses_written_ = 0, missed_ticks_ = 0;
  std::string failure_;
  ClientRun run_;
};

}  // namespace

int record(const RecordOptions& options) {
  return Recorder(options).run();
}

}  // namespace brachy
