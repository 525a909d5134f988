#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace brachy::net {

/// The time a peer takes to answer a PING: the median of the last kWindow, so that a single late answer does not
/// change the rendered stiffness. Measured by our clock alone. One thread.
class RoundTrip {
 public:
  static constexpr std::size_t kWindow = 9;

  void on_ping(std::uint64_t nonce, std::int64_t now_ns) {
    nonce_ = nonce;
    asked_ns_ = now_ns;
    is_waiting_ = true;
  }
  /// Only the first answer to the newest PING counts.
  void on_answer(std::uint64_t nonce, std::int64_t now_ns) {
    if (!is_waiting_ || nonce != nonce_) return;
    is_waiting_ = false;
    samples_[count_++ % kWindow] = now_ns - asked_ns_;
  }
  /// Since when the newest PING has been unanswered; nullopt: it is answered.
  std::optional<std::int64_t> waiting_since_ns() const {
    return is_waiting_ ? std::optional(asked_ns_) : std::nullopt;
  }

  std::optional<std::int64_t> median_ns() const {
    const std::size_t size = std::min(count_, kWindow);
    if (size == 0) return std::nullopt;
    auto sorted = samples_;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(size / 2);
    std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(size));
    return *middle;
  }

 private:
  std::array<std::int64_t, kWindow> samples_{};
  std::size_t count_ = 0;
  std::uint64_t nonce_ = 0;
  std::int64_t asked_ns_ = 0;
  bool is_waiting_ = false;
};

}  // namespace brachy::net
