#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/simulation/mesh_state.h"
#include "net/base/rate_limit.h"

namespace brachy {

/// Warnings for clients about the injectivity guard: "field folds at (x, y, z) mm", "sub-steps: 3",
/// "landmarks clamped 2.1 mm", "injective again". A change is reported when it is first seen, and the state
/// that lasts always. Of many changes kBurst are reported at once and then one per second of simulated time,
/// with the number omitted, so that a trembling needle does not flood the clients. No clock: the same states
/// give the same events.
/// Threads: one, the snapshot thread.
class GuardEvents {
 public:
  /// The warning for `tick`; nullopt if nothing changed or the rate limit delays it.
  std::optional<std::string> update(const TickSummary& tick);

 private:
  static constexpr double kPerSecond = 1;
  static constexpr double kBurst = 4;

  struct Guard {  // what a change is detected in
    Verdict verdict = Verdict::kInjective;
    std::uint32_t actions = 0;
    bool operator==(const Guard&) const = default;
  };

  Guard seen_, reported_;
  std::uint64_t passed_over_ = 0;
  net::RateLimit rate_{kPerSecond, kBurst};
};

}  // namespace brachy
