#include "net/session/device_lease.h"

namespace brachy::net {
namespace {

ErrorMessage refusal(ErrorCode code, const std::string& text) {
  return {code, true, 0, 0, text};
}

}  // namespace

std::optional<ErrorMessage> DeviceLeases::lend(const DeviceLease::Holder& holder, std::uint16_t wanted,
                                               std::uint16_t& granted) {
  std::size_t needle = wanted;
  if (wanted == kAnyNeedle) {
    for (needle = 0; needle < size(); ++needle)
      if (!leases_[needle].is_held() && needle != probe_) break;
    const bool is_none_free = needle == size();
    if (is_none_free) needle = 0;
    if (is_none_free && size() > 1) {
      return refusal(ErrorCode::kDeviceBusy, "every needle has a device (" + holders() +
                                                 "): disconnect one first, or join as a viewer");
    }
  } else if (needle >= size()) {
    return refusal(ErrorCode::kNoNeedle, "there is no needle " + std::to_string(needle) +
                                             ": needles are 0 to " + std::to_string(size() - 1));
  }
  DeviceLease& lease = leases_[needle];
  granted = static_cast<std::uint16_t>(needle);
  if (lease.take(holder)) return std::nullopt;
  const auto held_s = (holder.since_ns - lease.since_ns()) / 1'000'000'000;
  return refusal(ErrorCode::kDeviceBusy, lease.holder() + " has held the device lease" + of_needle(needle) +
                                             " for " + std::to_string(held_s) +
                                             " s: disconnect that device first, or join as a viewer");
}

std::string DeviceLeases::holders() const {
  if (size() == 1) return leases_[0].holder();
  std::string text;
  for (std::size_t needle = 0; needle < size(); ++needle) {
    if (!leases_[needle].is_held()) continue;
    text += (text.empty() ? "" : ", ") + std::to_string(needle) + ": " + leases_[needle].holder();
  }
  return text;
}

std::string DeviceLeases::of_needle(std::size_t needle) const {
  return size() > 1 ? " (needle " + std::to_string(needle) + ")" : "";
}

}  // namespace brachy::net
