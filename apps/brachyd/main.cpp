#include <arpa/inet.h>
#include <netinet/in.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>

#include "apps/command_line/daemon_line.h"
#include "apps/daemon/control/read_scene.h"
#include "apps/daemon/daemon.h"
#include "apps/daemon/exercise/attempts.h"
#include "apps/daemon/service/escaping_formatter.h"
#include "apps/daemon/service/stderr_sink.h"
#include "apps/daemon/telemetry/summary_report.h"
#include "apps/doctor/doctor.h"
#include "apps/terminal/set_up_progress.h"
#include "core/base/error.h"
#include "core/base/escaped.h"
#include "core/brachytherapy/plan/entry_doubts.h"
#include "core/brachytherapy/structures/anatomy.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_structures.h"

namespace {

using namespace brachy;

constexpr std::uint16_t kUsualHttpPort = 18951;

/// Whether a server could listen on this port of the loopback now.
bool is_free(std::uint16_t port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool is_bound = ::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  ::close(socket);
  return is_bound;
}

/// The page's address as a link, or how to get it.
std::string viewer_text(const Daemon& daemon, bool has_tls) {
  const auto port = daemon.http_port();
  if (!port) return "no viewer for browsers: start with --http-port 18951 to have it";
  return "viewer: " + std::string(has_tls ? "https" : "http") + "://" + daemon.address() + ":" +
         std::to_string(*port) + "/";
}

/// Where it listens, a line each, the native port first.
void announce(const Daemon& daemon, const DaemonOptions& options, bool has_tls) {
  // With --json each line of standard output is a JSON object.
  const auto print = [&](const std::string& what, const std::string& key, const std::string& address,
                         int port) {
    const std::string where = address + ":" + std::to_string(port);
    std::cout << (options.json ? "{\"" + key + "\":\"" + where + "\"}" : what + " " + where) << std::endl;
  };
  print("brachyd listening on", "listening_on", daemon.address(), daemon.port());
  if (const auto port = daemon.http_port())
    print(has_tls ? "https on" : "http on", has_tls ? "https_on" : "http_on", daemon.address(), *port);
  spdlog::info("{}", viewer_text(daemon, has_tls));
  if (const auto port = daemon.igtl_port()) print("igtl on", "igtl_on", daemon.igtl_address(), *port);
}

/// Signals that come while one daemon has ended and the next is not there yet wait for it.
class SignalsHeld {
 public:
  SignalsHeld() {
    sigset_t ends;
    sigemptyset(&ends);
    for (const int number : {SIGINT, SIGTERM}) sigaddset(&ends, number);
    pthread_sigmask(SIG_BLOCK, &ends, &before_);
  }
  ~SignalsHeld() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsHeld(const SignalsHeld&) = delete;
  SignalsHeld& operator=(const SignalsHeld&) = delete;

 private:
  sigset_t before_;
};

/// Who may connect, how, and with what scheduling: in all runs as the scene says that was named at the start. A scene
/// of an exercise has no tokens, and without them everybody could connect.
class KeptSettings {
 public:
  explicit KeptSettings(const Scene& scene)
      : server_(scene.server), broker_(scene.broker), realtime_(scene.realtime) {
    for (std::string* file : {&server_.token_file, &server_.device_token_file, &server_.viewer_token_file,
                              &server_.tls_certificate, &server_.tls_key, &server_.tls_client_ca,
                              &broker_.tls_ca, &broker_.tls_certificate, &broker_.tls_key})
      if (!file->empty()) *file = std::filesystem::absolute(scene.resolve(*file)).string();
  }
  Scene in(Scene scene) const {
    scene.server = server_;
    scene.broker = broker_;
    scene.realtime = realtime_;
    return scene;
  }

 private:
  ServerSettings server_;
  BrokerSettings broker_;
  RealtimeSettings realtime_;
};

/// The daemon of the next attempt, on the ports of the one that ended; where that cannot be, of the scene before,
/// without recording.
std::unique_ptr<Daemon> go_on(std::unique_ptr<Daemon> ended, const Attempt& next, const KeptSettings& kept,
                              DaemonOptions& options) {
  const SignalsHeld held;
  options.port = ended->port();
  if (const auto port = ended->http_port()) options.http_port = *port;
  if (const auto port = ended->igtl_port()) options.igtl_port = *port;
  ended.reset();
  DaemonOptions attempt = options;
  attempt.config = next.scene;
  attempt.session = next.session;
  attempt.trainee = next.trainee;
  attempt.trajectory.reset();
  try {
    auto daemon = std::make_unique<Daemon>(kept.in(read_scene(attempt)), attempt);
    options = attempt;
    return daemon;
  } catch (const UserError& e) {
    spdlog::error("the attempt cannot begin: {}; the scene before goes on, unrecorded", e.what());
  }
  options.session.reset();
  return std::make_unique<Daemon>(kept.in(read_scene(options)), options);
}

int run(DaemonOptions options) {
  options.set_up = announced_set_up([](const std::string& line) { spdlog::info(line); });
  const Scene scene = read_scene(options);
  if (options.check_config) {
    DaemonOptions any_port = options;
    any_port.port = 0;  // a scene is valid whether or not another daemon uses its ports
    if (scene.server.http_port > 0) any_port.http_port = 0;
    if (scene.server.igtl_port > 0) any_port.igtl_port = 0;
    const Daemon daemon(scene, any_port);
    if (const auto plan = load_plan(scene))
      for (const std::string& doubt : entry_doubts(*plan)) spdlog::warn("{}", doubt);
    for (const std::string& warning : geometry_warnings(scene, load_structures(scene)))
      std::cerr << escaped(options.config->string()) << ": WARNING: " << escaped(warning) << "\n";
    std::cout << escaped(options.config->string()) << ": ok\n";
    return kExitOk;
  }
  if (options.sessions && options.config)
    if (const auto exercise = exercise_of_scene(*options.config))
      options.session = next_attempt(*options.sessions, *exercise, options.trainee).session;
  auto daemon = std::make_unique<Daemon>(scene, options);
  announce(*daemon, options, scene.server.has_tls());
  const KeptSettings kept(scene);
  for (;;) {
    const DaemonSummary summary = daemon->run();
    std::cerr << to_text(summary);
    if (options.json) std::cout << to_json(summary) << std::endl;
    if (!summary.next) {
      if (summary.is_worker_busy)
        std::_Exit(kExitOk);  // all is reported and closed; do not wait for the worker
      return kExitOk;
    }
    if (options.duration_s) *options.duration_s = std::max(*options.duration_s - summary.elapsed_s, 1e-3);
    daemon = go_on(std::move(daemon), *summary.next, kept, options);
  }
}

}  // namespace

int main(int argc, char** argv) {
  // A closed log pipe or a file size limit must not kill the daemon: the write fails and is reported.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  // never destroyed: cerr is flushed last
  static NonBlockingStderr& non_blocking_stderr = *new NonBlockingStderr(STDERR_FILENO);
  if (non_blocking_stderr.is_needed()) {
    std::cerr.rdbuf(&non_blocking_stderr);
    const auto sink = std::make_shared<StderrSink>(non_blocking_stderr);
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("brachyd", sink));
    spdlog::register_logger(std::make_shared<spdlog::logger>(kSafetyLogger, sink));
  } else {
    spdlog::set_default_logger(spdlog::stderr_color_mt("brachyd"));
  }
  spdlog::set_formatter(std::make_unique<EscapingFormatter>("%H:%M:%S.%e %^%l%$ %v"));
  std::optional<int> exit_code;
  DaemonOptions options = parse_daemon_line(argc, argv, exit_code);
  if (exit_code) return *exit_code;
  // Somebody who starts it with nothing wants to see something.
  if (argc == 1) options.http_port = is_free(kUsualHttpPort) ? kUsualHttpPort : 0;
  try {
    return options.doctor_s ? doctor(options) : run(options);
  } catch (const UserError& e) {
    std::cerr << "brachyd: " << escaped(e.what()) << "\n";
    return kExitBadInput;
  } catch (const std::exception& e) {
    std::cerr << "brachyd: " << escaped(e.what()) << "\n";
    return kExitFailed;
  }
}
