#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace brachy::net::igtl {

/// The needle whose pose a TRANSFORM of this name is, as OpenIGTLink's programs write names, XToY: X is "Needle" or
/// "NeedleTip" with the needle's number behind it, 0 where there is none; Y is not looked at and may be missing.
/// nullopt: it is something else's.
std::optional<std::uint16_t> needle_of(std::string_view device);

/// "NeedleToRas"; of several needles "Needle2ToRas".
std::string pose_name(std::size_t needle, std::size_t count);
/// "ForceToRas", likewise.
std::string force_name(std::size_t needle, std::size_t count);
/// "BentTipToRas", likewise: not "NeedleTip", which needle_of() takes for the needle's pose.
std::string bent_tip_name(std::size_t needle, std::size_t count);

}  // namespace brachy::net::igtl
