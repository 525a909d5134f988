#pragma once

#include <string_view>

#include "net/wire/messages.h"

namespace brachy {

/// An event's kind as written in events.csv and reports.
constexpr std::string_view to_string(net::EventKind kind) {
  switch (kind) {
    case net::EventKind::kNote:
      return "note";
    case net::EventKind::kContact:
      return "contact";
    case net::EventKind::kPuncture:
      return "puncture";
    case net::EventKind::kReset:
      return "reset";
    case net::EventKind::kDeviceAttached:
      return "device_attached";
    case net::EventKind::kDeviceDetached:
      return "device_detached";
    case net::EventKind::kWarning:
      return "warning";
    case net::EventKind::kSafety:
      return "safety";
    case net::EventKind::kSeed:
      return "seed";
    case net::EventKind::kStructure:
      return "structure";
    case net::EventKind::kSeedLost:
      return "seed_lost";
  }
  return "other";
}

}  // namespace brachy
