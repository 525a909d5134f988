#include "apps/doctor/trial.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>

#include "apps/daemon/daemon.h"
#include "core/base/error.h"
#include "core/scene/load_tissue.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {
namespace {

constexpr char kDone = 'd', kRefused = 'r', kFailed = 'f';  // the first byte of a trial's answer

/// The scene in isolation: a free port, no token files, no file written, nothing published.
Scene alone(Scene scene, const std::filesystem::path& trajectory) {
  scene.server = {};
  scene.server.port = 0;
  scene.broker = {};
  scene.device = {};
  scene.device.trajectory = trajectory.string();
  scene.realtime.control_thread = true;
  return scene;
}

TrialResult run_here(const Scene& scene, double seconds) {
  DaemonOptions options;
  options.play = true;
  options.duration_s = seconds;
  Daemon daemon(scene, options);
  const DaemonSummary s = daemon.run();
  const auto ms = [](std::int64_t ns) { return 1e-6 * static_cast<double>(ns); };
  TrialResult result;
  result.ticks = s.loop.ticks;
  result.missed = s.loop.overruns;
  result.control_ticks = s.control.ticks;
  result.control_missed = s.control.overruns;
  result.tick_p50_ms = ms(s.loop.tick_ns.quantile(0.5));
  result.tick_p99_ms = ms(s.loop.tick_ns.quantile(0.99));
  result.tick_max_ms = ms(s.loop.tick_ns.max());
  result.lateness_p99_ms = ms(s.loop.lateness_ns.quantile(0.99));
  result.late = s.loop.certificates.late;
  result.max_lag_mm = s.loop.certificates.max_lag_mm;
  return result;
}

void write_all(int descriptor, char kind, const void* data, std::size_t size) {
  std::string answer(1, kind);
  answer.append(static_cast<const char*>(data), size);
  for (std::string_view left = answer; !left.empty();) {
    const ssize_t written = ::write(descriptor, left.data(), left.size());
    if (written < 0) return;
    left.remove_prefix(static_cast<std::size_t>(written));
  }
}

/// The child's whole life. It dies with its parent.
[[noreturn]] void answer(int descriptor, const Scene& scene, double seconds) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  try {
    const TrialResult result = run_here(scene, seconds);
    write_all(descriptor, kDone, &result, sizeof result);
  } catch (const UserError& e) {
    write_all(descriptor, kRefused, e.what(), std::strlen(e.what()));
  } catch (const std::exception& e) {
    write_all(descriptor, kFailed, e.what(), std::strlen(e.what()));
  }
  _exit(0);
}

std::string read_to_end(int descriptor) {
  std::string all;
  std::array<char, 4096> piece;
  for (ssize_t size = 0; (size = ::read(descriptor, piece.data(), piece.size())) != 0;) {
    if (size < 0 && errno != EINTR) break;
    if (size > 0) all.append(piece.data(), static_cast<std::size_t>(size));
  }
  return all;
}

}  // namespace

TrialResult try_scene(const Scene& scene, const std::filesystem::path& trajectory, double seconds) {
  const Scene tried = alone(scene, trajectory);
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  if (child == 0) {
    ::close(ends[0]);
    answer(ends[1], tried, seconds);
  }
  ::close(ends[1]);
  const std::string answer = read_to_end(ends[0]);
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (answer.starts_with(kRefused)) throw UserError(answer.substr(1));
  if (answer.starts_with(kFailed)) throw std::runtime_error(answer.substr(1));
  TrialResult result;
  if (answer.size() != 1 + sizeof result)
    throw std::runtime_error(
        WIFSIGNALED(status) ? "the scene's daemon was killed by signal " + std::to_string(WTERMSIG(status)) +
                                  (WTERMSIG(status) == SIGKILL ? "; is there enough memory?" : "")
                            : "the scene's daemon ended without an answer");
  std::memcpy(&result, answer.data() + 1, sizeof result);
  return result;
}

std::string representative_insertion(const Scene& scene, double seconds) {
  constexpr double kOutsideMm = 10, kBesideMm = 8, kPushMm = 1, kDepth = 0.8;
  const auto& vertices = load_surface(scene).mesh.vertices;
  Vec3 least = vertices.front(), most = vertices.front();
  for (const Vec3& v : vertices) {
    least = least.cwiseMin(v);
    most = most.cwiseMax(v);
  }
  const Vec3 middle = 0.5 * (least + most), size = most - least;
  const double outside = least.z() - kOutsideMm, inside = least.z() + kDepth * size.z();
  struct Keyframe {
    double share, x, z;
  };
  constexpr double kIn = 0.55, kRest = 0.65, kPushed = 0.7, kBack = 0.75, kOut = 0.95;  // of the time
  const std::array<Keyframe, 6> way = {{{0, 0, outside},
                                        {kIn, 0, inside},
                                        {kRest, 0, inside},
                                        {kPushed, kPushMm, inside},
                                        {kBack, 0, inside},
                                        {kOut, 0, outside}}};
  const auto needles = static_cast<int>(scene.needle.count);
  std::string csv = trajectory_header({.needle = true}) + "\n";
  for (const Keyframe& at : way)
    for (int n = 0; n < needles; ++n) {
      // Side by side in rows of four, beside the middle, where the urethra is.
      const Vec3 beside(kBesideMm * (n % 4 + 1 - 0.5 * std::min(needles - 1, 3)), kBesideMm * (n / 4) - 4, 0);
      const Vec3 tip(middle.x() + beside.x() + at.x, middle.y() + beside.y(), at.z);
      csv += trajectory_row({at.share * seconds, {Mat3::Identity(), tip}}, static_cast<std::uint32_t>(n),
                            {.needle = true}) +
             "\n";
    }
  return csv;
}

}  // namespace brachy
