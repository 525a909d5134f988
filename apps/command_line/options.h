#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/command_line/exit_code.h"
#include "core/base/set_up.h"

namespace brachy {

/// Options of brachyd, after checking. Lengths in mm, times in s.

struct DaemonOptions {
  /// none: the built-in defaults, which are config/prostate.toml's
  std::optional<std::filesystem::path> config;
  bool check_config = false;                        ///< load the scene and its files, then exit
  std::optional<int> port;                          ///< none: the scene's
  std::optional<int> http_port;                     ///< none: the scene's
  std::optional<int> igtl_port;                     ///< none: the scene's
  std::optional<std::string> broker;                ///< its URL; none: the scene's
  std::optional<double> duration_s;                 ///< none: until SIGINT or SIGTERM
  std::optional<std::filesystem::path> trajectory;  ///< of the scripted needle; none: the scene's
  bool play = false;                                ///< start it at once, in a loop
  /// directory to record into, or to resume; none: nothing is recorded
  std::optional<std::filesystem::path> session;
  /// directory in which each attempt at an exercise gets one of its own to record into; none: no attempts
  std::optional<std::filesystem::path> sessions;
  std::string trainee;  ///< whose session it is, as it is to stand in its files; empty: nobody's
  std::string simd;     ///< empty: the scene's
  bool control_thread = false;
  bool insecure_allow_remote = false;
  std::optional<double> report_every_s;  ///< none: only the closing summary
  std::optional<double> doctor_s;        ///< `brachyd doctor`: duration of each measurement
  bool json = false;
  SetUp set_up;  ///< of the first model; not from the command line
};

}  // namespace brachy
