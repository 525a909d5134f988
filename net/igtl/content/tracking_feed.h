#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/simulation/mesh_state.h"
#include "net/igtl/codec/codec.h"
#include "net/igtl/content/needle_name.h"

namespace brachy::net::igtl {

/// The needles' poses in one tick: TDATA may be asked for more often than there are snapshots.
struct TrackedTick {
  std::uint64_t run = 0;  ///< TickSummary::run
  double sim_time_s = 0;
  std::int64_t time_ns =
      0;  ///< monotonic, when it was made: on a loaded machine ticks are lost, and simulated time lags
  std::vector<std::optional<RigidTransform>> X_WN;  ///< by needle; none: not there

  static TrackedTick of(const MeshState& state) {
    const auto simulated_ns = static_cast<std::int64_t>(1e9 * state.summary.sim_time_s);
    TrackedTick tick{state.summary.run,
                     state.summary.sim_time_s,
                     state.summary.publish_ns != 0 ? state.summary.publish_ns : simulated_ns,
                     {}};
    for (const NeedleState& needle : state.needles.states)
      tick.X_WN.push_back(needle.present ? std::optional(needle.X_WN) : std::nullopt);
    return tick;
  }
};

/// The newest tick and its TDATA, encoded once for each header version. One thread.
class TrackingFeed {
 public:
  /// False: it is no newer than the last one (of a snapshot that was overtaken), and is not taken.
  bool update(TrackedTick tick, std::int64_t utc_ns) {
    const auto order = [](const TrackedTick& t) { return std::pair(t.run, t.sim_time_s); };
    if (has_tick_ && order(tick) <= order(tick_)) return false;
    has_tick_ = true;
    tick_ = std::move(tick);
    timestamp_ = to_timestamp(utc_ns);
    messages_ = {};
    return true;
  }

  std::int64_t time_ns() const { return tick_.time_ns; }

  /// All needles that are there, as tools.
  std::shared_ptr<const Bytes> message(std::uint16_t version, const Naming& naming) {
    auto& message = messages_[version - 1u];
    if (!message) {
      std::vector<TrackedTool> tools;
      for (std::size_t n = 0; n < tick_.X_WN.size(); ++n)
        if (tick_.X_WN[n])
          tools.push_back({naming.pose_name(n, tick_.X_WN.size()), naming.to_peer(*tick_.X_WN[n])});
      message = std::make_shared<const Bytes>(encode_tracking({version, "Needles", timestamp_}, tools));
    }
    return message;
  }

 private:
  bool has_tick_ = false;
  TrackedTick tick_;
  std::uint64_t timestamp_ = 0;
  std::array<std::shared_ptr<const Bytes>, 2> messages_;  // by version
};

}  // namespace brachy::net::igtl
