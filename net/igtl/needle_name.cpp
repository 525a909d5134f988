#include "net/igtl/needle_name.h"

#include <charconv>

#include "net/wire/messages.h"

namespace brachy::net::igtl {
namespace {

std::string name(std::string_view what, std::size_t needle, std::size_t count) {
  return std::string(what) + (count > 1 ? std::to_string(needle) : "") + "ToRas";
}

}  // namespace

std::optional<std::uint16_t> needle_of(std::string_view device) {
  constexpr std::string_view kNeedle = "Needle", kTip = "Tip";
  if (!device.starts_with(kNeedle)) return std::nullopt;
  device.remove_prefix(kNeedle.size());
  if (device.starts_with(kTip)) device.remove_prefix(kTip.size());
  std::uint16_t needle = 0;
  const auto [end, error] = std::from_chars(device.data(), device.data() + device.size(), needle);
  if (error == std::errc::result_out_of_range || needle == kAnyNeedle) return std::nullopt;
  device.remove_prefix(static_cast<std::size_t>(end - device.data()));
  if (!device.empty() && !device.starts_with("To")) return std::nullopt;
  return needle;
}

std::string pose_name(std::size_t needle, std::size_t count) {
  return name("Needle", needle, count);
}
std::string force_name(std::size_t needle, std::size_t count) {
  return name("Force", needle, count);
}
std::string bent_tip_name(std::size_t needle, std::size_t count) {
  return name("BentTip", needle, count);
}

}  // namespace brachy::net::igtl
