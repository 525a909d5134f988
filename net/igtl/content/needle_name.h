#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy::net::igtl {

/// How peers name needles, and the frame F that all coordinates are in, received and sent.
struct Naming {
  std::string frame = "Ras";  ///< its name, behind "To"
  RigidTransform X_WF;        ///< F in the world W (RAS), mm; identity: F is W
  /// Of TRANSFORMs that move needle 0, 1, … beside those that needle_of() knows; empty: none of that needle's.
  std::vector<std::string> needle_names;
  /// The instrument that is the ultrasound probe, behind the needles, which keep their names; none: there is none.
  std::optional<std::uint16_t> probe;

  bool is_world() const { return X_WF == RigidTransform(); }
  /// From a peer's pose to X_WN and back; the same bits where F is W.
  RigidTransform to_world(const RigidTransform& X_FN) const { return is_world() ? X_FN : X_WF * X_FN; }
  RigidTransform to_peer(const RigidTransform& X_WN) const {
    return is_world() ? X_WN : X_WF.inverse() * X_WN;
  }

  /// The needle, or the probe ("ProbeToRas"), that a TRANSFORM of this name moves; nullopt: none.
  std::optional<std::uint16_t> needle_of(std::string_view device) const;
  bool is_probe(std::size_t instrument) const { return probe && *probe == instrument; }

  // Of an instrument of `count`, the probe included.
  /// "NeedleToRas"; of several needles "Needle2ToRas"; "ProbeToRas".
  std::string pose_name(std::size_t needle, std::size_t count) const;
  /// "ForceToRas", likewise.
  std::string force_name(std::size_t needle, std::size_t count) const;
  /// "BentTipToRas", likewise: not "NeedleTip", which needle_of() takes for the needle's pose.
  std::string bent_tip_name(std::size_t needle, std::size_t count) const;
  /// "ErrorToRas", likewise: from the tip to the nearest target.
  std::string error_name(std::size_t needle, std::size_t count) const;
  /// "NeedleShape"; of several needles "Needle2Shape": the device of a POINT, which no TRANSFORM has.
  std::string shape_name(std::size_t needle, std::size_t count) const;

 private:
  std::string number_of(std::size_t needle, std::size_t count) const;
};

/// The needle whose pose a TRANSFORM of this name is, as OpenIGTLink's programs write names, XToY: X is "Needle" or
/// "NeedleTip" with the needle's number behind it, 0 where there is none; Y is not looked at and may be missing.
/// nullopt: it is something else's.
std::optional<std::uint16_t> needle_of(std::string_view device);

/// The names in a list "A, B, C", without the spaces around them.
std::vector<std::string> names_in(std::string_view list);

}  // namespace brachy::net::igtl
