#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <cstdio>
#include <iostream>

#include "apps/brachyd/daemon.h"
#include "apps/brachyd/summary_report.h"
#include "apps/command_line.h"
#include "core/choice/choice.h"
#include "core/error.h"
#include "core/scene/scene_file.h"

namespace {

using namespace brachy;

int run(const DaemonOptions& options) {
  Scene scene = options.config ? load_scene(*options.config) : Scene{};
  if (!options.simd.empty()) scene.engine.simd = options.simd;
  if (options.trajectory) scene.device.trajectory = std::filesystem::absolute(*options.trajectory).string();
  std::string choice;
  scene = with_choice(scene, &choice);
  if (!choice.empty()) spdlog::info("{}", choice);
  if (options.check_config) {
    DaemonOptions any_port = options;
    any_port.port = 0;  // a scene is good whether or not another daemon runs
    if (scene.server.http_port > 0) any_port.http_port = 0;
    if (scene.server.igtl_port > 0) any_port.igtl_port = 0;
    const Daemon daemon(scene, any_port);
    std::cout << options.config->string() << ": ok\n";
    return kExitOk;
  }
  Daemon daemon(scene, options);
  std::cout << "brachyd listening on " << daemon.address() << ":" << daemon.port() << std::endl;
  if (const auto port = daemon.http_port())
    std::cout << (scene.server.has_tls() ? "https on " : "http on ") << daemon.address() << ":" << *port
              << std::endl;
  if (const auto port = daemon.igtl_port())
    std::cout << "igtl on " << daemon.igtl_address() << ":" << *port << std::endl;
  const DaemonSummary summary = daemon.run();
  std::cerr << to_text(summary);
  if (options.json) std::cout << to_json(summary) << std::endl;
  return kExitOk;
}

}  // namespace

int main(int argc, char** argv) {
  // A log that nobody reads any more, or a file that may not grow, ends nothing: the write fails, and says so.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  spdlog::set_default_logger(spdlog::stderr_color_mt("brachyd"));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");
  std::optional<int> exit_code;
  const DaemonOptions options = parse_daemon_line(argc, argv, exit_code);
  if (exit_code) return *exit_code;
  try {
    return run(options);
  } catch (const UserError& e) {
    std::cerr << "brachyd: " << e.what() << "\n";
    return kExitBadInput;
  } catch (const std::exception& e) {
    std::cerr << "brachyd: " << e.what() << "\n";
    return kExitFailed;
  }
}
