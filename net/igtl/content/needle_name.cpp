#include "net/igtl/content/needle_name.h"

#include <algorithm>
#include <charconv>

#include "net/wire/messages.h"

namespace brachy::net::igtl {
namespace {

std::string name(std::string_view what, std::size_t needle, std::size_t count, const std::string& frame) {
  return std::string(what) + (count > 1 ? std::to_string(needle) : "") + "To" + frame;
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

std::optional<std::uint16_t> Naming::needle_of(std::string_view device) const {
  for (std::size_t n = 0; n < needle_names.size(); ++n)
    if (!needle_names[n].empty() && needle_names[n] == device) return static_cast<std::uint16_t>(n);
  return igtl::needle_of(device);
}

std::string Naming::pose_name(std::size_t needle, std::size_t count) const {
  return name("Needle", needle, count, frame);
}
std::string Naming::force_name(std::size_t needle, std::size_t count) const {
  return name("Force", needle, count, frame);
}
std::string Naming::bent_tip_name(std::size_t needle, std::size_t count) const {
  return name("BentTip", needle, count, frame);
}
std::string Naming::error_name(std::size_t needle, std::size_t count) const {
  return name("Error", needle, count, frame);
}

std::string shape_name(std::size_t needle, std::size_t count) {
  return "Needle" + (count > 1 ? std::to_string(needle) : "") + "Shape";
}

std::vector<std::string> names_in(std::string_view list) {
  std::vector<std::string> names;
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    std::string_view one = list.substr(0, comma);
    list.remove_prefix(std::min(comma + 1, list.size()));
    one.remove_prefix(std::min(one.find_first_not_of(' '), one.size()));
    names.emplace_back(one.substr(0, one.find_last_not_of(' ') + 1));
  }
  return names;
}

}  // namespace brachy::net::igtl
