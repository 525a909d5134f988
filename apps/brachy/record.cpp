#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/brachy/client_run.h"
#include "apps/brachy/paraview_writer.h"
#include "apps/brachy/tools.h"
#include "apps/session/session_log.h"
#include "core/error.h"

namespace brachy {
namespace {

class Recorder {
 public:
  explicit Recorder(const RecordOptions& options) : options_(options), run_(client_options(), handlers()) {
    std::error_code error;
    std::filesystem::create_directories(options.out, error);
    if (error) throw UserError(options.out.string() + ": cannot be made: " + error.message());
    if (SessionLog::is_recording(options.out) || std::filesystem::exists(options.out / "recording.pvd"))
      throw UserError(options.out.string() +
                      ": holds a recording already; give another folder, nothing is overwritten");
  }

  int run() {
    run_.run(options_.connect, options_.duration_s);
    attempt([&] {
      if (log_) log_->close();
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
      needle_count_ = welcome.needle_count;
    };
    h.on_topology = [this](const net::TopologyMessage& t) {
      attempt([&] {
        surface_count_ = t.surface_vertex_count;
        paraview_.emplace(options_.out, t.triangles, points_of(t.rest_vertices, surface_count_),
                          surface_count_);
        log_.emplace(options_.out, needle_count_, period_s_);
      });
    };
    h.on_frame = [this](const net::FrameMessage& frame) {
      attempt([&] {
        paraview_->add(frame.sim_time_s, points_of(run_.client().mesh().positions(), surface_count_),
                       frame.certificate);
        log_->add_seeds(run_.client().mesh().seeds());
        log_poses(frame);
        log_forces(frame);
        log_->flush();
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
    std::vector<UsedPose> used;
    for (const TickPose& pose : frame.pose_history) used.push_back({0, pose});
    for (const net::NeedlePoses& other : frame.poses_of_needles)
      for (const TickPose& pose : other.poses) used.push_back({other.needle, pose});
    log_->add_poses(std::move(used));
  }

  // Snapshots only: what happened between two is not sent.
  void log_forces(const net::FrameMessage& frame) {
    const double det = frame.certificate ? frame.certificate->vertex_det : Certificate::kNotKnown;
    for (const net::NeedleRecord& needle : frame.needles)
      if (needle.state.present && needle.has_forces)
        log_->add_forces(frame.tick, needle.id, needle.state, det);
  }

  void report() const {
    const std::size_t steps = paraview_ ? paraview_->steps() : 0, seeds = log_ ? log_->seeds() : 0;
    const std::uint64_t poses = log_ ? log_->poses() : 0, forces = log_ ? log_->forces() : 0;
    const std::uint64_t missed = log_ ? log_->ticks_missed() : 0;
    if (options_.json) {
      const nlohmann::ordered_json json = {{"out", options_.out.string()},
                                           {"snapshots", steps},
                                           {"poses", poses},
                                           {"forces", forces},
                                           {"seeds", seeds},
                                           {"ticks_missed", missed},
                                           {"seq_gaps", run_.client().snapshots_missed()}};
      std::cout << json.dump() << "\n";
      return;
    }
    std::cout << fmt::format(
                     "record: {} snapshots in {}/recording.pvd (ParaView), {} poses in {}/poses.csv, "
                     "{} forces in {}/forces.csv, {} seeds in {}/seeds.csv",
                     steps, options_.out.string(), poses, options_.out.string(), forces,
                     options_.out.string(), seeds, options_.out.string())
              << (missed ? fmt::format("; {} ticks' poses were missed\n", missed) : "\n");
  }

  RecordOptions options_;
  double period_s_ = 0;
  std::size_t surface_count_ = 0;
  std::optional<ParaviewWriter> paraview_;
  std::optional<SessionLog> log_;
  std::size_t needle_count_ = 1;
  std::string failure_;
  ClientRun run_;
};

}  // namespace

int record(const RecordOptions& options) {
  return Recorder(options).run();
}

}  // namespace brachy
