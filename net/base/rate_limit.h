#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string_view>

namespace brachy::net {

/// Token bucket: `per_s` events a second on average, bursts of `burst` at once. Starts full.
class RateLimit {
 public:
  RateLimit(double per_s, double burst) : per_s_(per_s), burst_(burst), tokens_(burst) {}

  /// True where an event may pass now; counts it.
  bool pass(std::int64_t now_ns) {
    if (last_ns_ != 0)
      tokens_ = std::min(burst_, tokens_ + static_cast<double>(now_ns - last_ns_) * 1e-9 * per_s_);
    last_ns_ = now_ns;
    if (tokens_ < 1) return false;
    tokens_ -= 1;
    return true;
  }

 private:
  double per_s_;
  double burst_;
  double tokens_;
  std::int64_t last_ns_ = 0;
};

/// How often something may happen, as RateLimit's constructor takes it. Those of one name share a bucket.
struct Rate {
  std::string_view name;  ///< a literal
  double per_s = 0, burst = 0;
};

/// The buckets of one peer.
class RateLimits {
 public:
  bool pass(const Rate& rate, std::int64_t now_ns) {
    return limits_.try_emplace(rate.name, rate.per_s, rate.burst).first->second.pass(now_ns);
  }

 private:
  std::map<std::string_view, RateLimit> limits_;
};

}  // namespace brachy::net
