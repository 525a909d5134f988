#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/brachy/replay/simulated_device.h"
#include "apps/command_line/option_groups.h"
#include "core/base/rigid_transform.h"

namespace brachy {

struct ReplayOptions {
  std::filesystem::path trajectory;             ///< CSV or recording
  std::optional<ConnectOptions> connect;        ///< none: offline
  std::optional<std::filesystem::path> config;  ///< offline
  double rate_hz = 200;
  double speed = 1;
  bool loop = false;
  bool centre_on_tissue = false;
  Vec3 translate_mm = Vec3::Zero();
  int threads = 0;                               ///< offline; 0: the scene's
  std::string simd;                              ///< offline; empty: the scene's
  std::optional<std::filesystem::path> log;      ///< offline: the force log to write
  std::optional<std::filesystem::path> session;  ///< offline: directory to record and to report in
  std::optional<SimulatedDeviceOptions> device;  ///< none: the trajectory is the needle's
  std::optional<double> from_s;                  ///< offline: start from a state that the session kept before
  bool json = false;
  bool what_if = false;  ///< offline: a session's poses in another scene than its own
  std::string trainee;   ///< offline, of `session`; empty: nobody's
  bool force = false;    ///< overwrite a log that exists
};

/// Steps the simulation through the trajectory without clock or network and prints a hash of every tick's state.
/// Both return an ExitCode and throw UserError for bad input.
int replay_offline(const ReplayOptions& options);
/// Plays the trajectory into a daemon as its device.
int replay_live(const ReplayOptions& options);

}  // namespace brachy
