#pragma once

#include <optional>
#include <thread>
#include <vector>

#include "apps/daemon/daemon.h"
#include "core/base/rigid_transform.h"

namespace brachy::test {

/// A scene whose ticks are quick.
inline Scene small() {
  Scene scene;
  scene.model.kernel = "psi31";
  scene.tissue.points = 3000;
  scene.tissue.phantom_surface_vertices = 400;
  scene.rates.snapshot_hz = 60;
  // The machine may be busy.
  scene.device.stale_pose_ms = 60'000;
  scene.server.hello_timeout_ms = 60'000;
  scene.server.silence_timeout_ms = scene.server.stall_timeout_ms = 600'000;
  scene.server.port = 0;
  return scene;
}

/// A Daemon in a thread of this process, ended by the destructor at the latest.
class RunningDaemon {
 public:
  explicit RunningDaemon(const Scene& scene, std::optional<double> duration_s = {})
      : RunningDaemon(scene, options(duration_s)) {}
  RunningDaemon(const Scene& scene, const DaemonOptions& options)
      : daemon_(scene, options), thread_([this] { summary_ = daemon_.run(); }) {}
  ~RunningDaemon() { stop(); }

  std::uint16_t port() const { return daemon_.port(); }
  std::uint16_t igtl_port() const { return daemon_.igtl_port().value(); }
  const DaemonSummary& stop() {
    daemon_.stop();
    return wait();
  }
  const DaemonSummary& wait() {
    if (thread_.joinable()) thread_.join();
    return summary_;
  }

 private:
  static DaemonOptions options(std::optional<double> duration_s) {
    DaemonOptions o;
    o.duration_s = duration_s;
    return o;
  }
  DaemonSummary summary_;
  Daemon daemon_;
  std::thread thread_;
};

inline RigidTransform tip_at(double x, double y, double z) {
  return {Mat3::Identity(), Vec3(x, y, z)};
}

// Tip positions in steps that are no jump (contact.max_jump_mm): in, a push to the side, out.
inline std::vector<RigidTransform> way_in() {
  std::vector<RigidTransform> way;
  for (double z = -34; z <= 11; z += 3) way.push_back(tip_at(8, -4, z));
  for (double x = 8.5; x <= 9.5; x += 0.5) way.push_back(tip_at(x, -4.2, 11));
  return way;
}
inline std::vector<RigidTransform> way_out() {
  auto way = way_in();
  return {way.rbegin(), way.rend()};
}

}  // namespace brachy::test
