#pragma once

#include <cstdint>
#include <string_view>

namespace brachy {

/// The contact of a needle with the tissue (core/DESIGN.md, section 5). Sent over the wire: append only.
enum class ContactState : std::uint8_t {
  kFree = 0,       ///< never touched since the last reset
  kTouching = 1,   ///< pressing on the intact capsule: one landmark
  kInserted = 2,   ///< the tip is inside: landmarks along the cut path
  kThrough = 3,    ///< the tip has left through the far side, the shaft is still inside
  kWithdrawn = 4,  ///< has been in and is out again; the tissue is at rest
};

/// The state's name in logs, events and reports.
constexpr std::string_view to_string(ContactState state) {
  switch (state) {
    case ContactState::kFree:
      return "free";
    case ContactState::kTouching:
      return "touching";
    case ContactState::kInserted:
      return "inserted";
    case ContactState::kThrough:
      return "through";
    case ContactState::kWithdrawn:
      return "withdrawn";
  }
  return "unknown";
}

}  // namespace brachy
