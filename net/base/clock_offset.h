#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace brachy::net {

/// Offset of a peer's monotonic clock from ours, from PING replies: of the last kWindow samples the one with the
/// shortest round trip counts, since its error is at most half of that trip.
class ClockOffset {
 public:
  static constexpr std::size_t kWindow = 16;

  struct Sample {
    std::int64_t offset_ns = 0;      ///< peer's clock − ours
    std::int64_t round_trip_ns = 0;  ///< on the wire; the offset is right to within half of it
  };

  /// Our clock when the request left and when the reply came; the peer's when the request came and the reply left.
  void add(std::int64_t sent, std::int64_t peer_received, std::int64_t peer_sent, std::int64_t received) {
    // The peer's stamps are not trusted: in double, no difference of them overflows.
    const auto difference = [](std::int64_t a, std::int64_t b) {
      return static_cast<double>(a) - static_cast<double>(b);
    };
    if (difference(peer_sent, peer_received) < 0 || difference(received, sent) < 0) return;
    const double round_trip = difference(received, sent) - difference(peer_sent, peer_received);
    if (round_trip < 0) return;
    // Both halves fit: stamps are not negative, so each difference is below 2^63.
    const std::int64_t offset = (peer_received - sent) / 2 + (peer_sent - received) / 2;
    samples_[count_++ % kWindow] = {offset, static_cast<std::int64_t>(round_trip)};
  }

  std::optional<Sample> best() const {
    std::optional<Sample> best;
    for (std::size_t i = 0; i < count_ && i < kWindow; ++i) {
      if (!best || samples_[i].round_trip_ns < best->round_trip_ns) best = samples_[i];
    }
    return best;
  }

 private:
  std::array<Sample, kWindow> samples_{};
  std::size_t count_ = 0;
};

}  // namespace brachy::net
