#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "core/realtime/deadline.h"
#include "haptics/devices/pose_fault.h"
#include "net/session/notice_queue.h"

namespace brachy {

/// Names what is wrong with the poses of a device to every client and to the log: each fault of a device once, however
/// many poses have it. Of faults that come faster than the rate, as of a peer that connects again and again, the newest
/// of a needle and fault says how many. Threads: the io thread.
class PoseNotices {
 public:
  static constexpr double kPerS = 10, kBurst = 40;
  /// Devices and faults that are remembered; then all are forgotten.
  static constexpr std::size_t kMostNamed = 4096;
  using Out = std::function<void(const net::EventMessage&)>;

  /// `clock` outlives this.
  PoseNotices(Clock& clock, Out out)
      : clock_(clock),
        queue_(kPerS, kBurst, [out = std::move(out)](net::EventMessage event, std::uint64_t count) {
          if (count > 1) event.text += "; " + std::to_string(count - 1) + " notices before it left out";
          out(event);
        }) {}

  /// `device`: its name and address, which no other connection has.
  void add(std::uint16_t needle, const std::string& device, PoseFault fault) {
    if (named_.size() == kMostNamed) named_.clear();
    if (!named_.emplace(device, needle, fault).second) return;
    queue_.add(std::to_string(static_cast<int>(fault)) + " " + std::to_string(needle),
               {net::EventKind::kWarning, needle, 0, device + ": " + std::string(to_string(fault))},
               clock_.now_ns());
  }
  /// Of fault_bit()s.
  void add_all(std::uint16_t needle, const std::string& device, std::uint32_t faults) {
    for (std::size_t n = 0; faults != 0 && n < kPoseFaults; ++n)
      if (const auto fault = static_cast<PoseFault>(n); faults & fault_bit(fault)) add(needle, device, fault);
  }
  /// The device left: another that comes from there is named again.
  void forget(const std::string& device) {
    std::erase_if(named_, [&](const auto& named) { return std::get<0>(named) == device; });
  }
  void update() { queue_.update(clock_.now_ns()); }
  void end() { queue_.end(); }  ///< passes on all that waits: the daemon ends

 private:
  Clock& clock_;
  net::NoticeQueue queue_;
  // Searched with every pose that has a fault.
  std::set<std::tuple<std::string, std::uint16_t, PoseFault>> named_;
};

}  // namespace brachy
