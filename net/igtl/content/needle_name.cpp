#include "net/igtl/content/needle_name.h"

#include <algorithm>
#include <charconv>

#include "net/wire/messages.h"

namespace brachy::net::igtl {
namespace {

/// Whether `device` begins with `what`, which is then taken away.
bool takes_name(std::string_view& device, std::string_view what) {
  if (!device.starts_with(what)) return false;
  device.remove_prefix(what.size());
  return true;
}

bool is_end_of_name(std::string_view rest) {
  return rest.empty() || rest.starts_with("To");
}

}  // namespace

std::optional<std::uint16_t> needle_of(std::string_view device) {
  if (!takes_name(device, "Needle")) return std::nullopt;
  takes_name(device, "Tip");
  std::uint16_t needle = 0;
  const auto [end, error] = std::from_chars(device.data(), device.data() + device.size(), needle);
  if (error == std::errc::result_out_of_range || needle == kAnyNeedle) return std::nullopt;
  device.remove_prefix(static_cast<std::size_t>(end - device.data()));
  if (!is_end_of_name(device)) return std::nullopt;
  return needle;
}

std::optional<std::uint16_t> Naming::needle_of(std::string_view device) const {
  for (std::size_t n = 0; n < needle_names.size(); ++n)
    if (!needle_names[n].empty() && needle_names[n] == device) return static_cast<std::uint16_t>(n);
  std::string_view rest = device;
  if (probe && takes_name(rest, "Probe") && is_end_of_name(rest)) return probe;
  return igtl::needle_of(device);
}

/// What tells one of several needles from the others.
std::string Naming::number_of(std::size_t needle, std::size_t count) const {
  const std::size_t needles = probe && *probe < count ? count - 1 : count;
  return needles > 1 ? std::to_string(needle) : "";
}

std::string Naming::pose_name(std::size_t needle, std::size_t count) const {
  return (is_probe(needle) ? "Probe" : "Needle" + number_of(needle, count)) + "To" + frame;
}
std::string Naming::force_name(std::size_t needle, std::size_t count) const {
  return "Force" + number_of(needle, count) + "To" + frame;
}
std::string Naming::bent_tip_name(std::size_t needle, std::size_t count) const {
  return "BentTip" + number_of(needle, count) + "To" + frame;
}
std::string Naming::error_name(std::size_t needle, std::size_t count) const {
  return "Error" + number_of(needle, count) + "To" + frame;
}
std::string Naming::shape_name(std::size_t needle, std::size_t count) const {
  return "Needle" + number_of(needle, count) + "Shape";
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
