#pragma once

#include <string>

#include "apps/daemon/telemetry/daemon_summary.h"

namespace brachy {

/// The daemon's closing summary: for people (a few lines) and for machines (one line of JSON).
std::string to_text(const DaemonSummary& summary);
std::string to_json(const DaemonSummary& summary);

}  // namespace brachy
