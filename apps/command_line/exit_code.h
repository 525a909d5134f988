#pragma once

namespace brachy {

/// Exit codes of the programs.
enum ExitCode : int {
  kExitOk = 0,
  kExitFailed = 1,    ///< failed while running: connection lost, disk full
  kExitBadInput = 2,  ///< usage, files, settings, a port in use
  kExitRefused = 3,   ///< the input is well-formed, but the result would be wrong (brachy deform)
};

}  // namespace brachy
