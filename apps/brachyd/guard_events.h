#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/sim/mesh_state.h"
#include "net/session/rate_limit.h"

namespace brachy {

/// When to warn the clients of what guards the field: "field folds at (x, y, z) mm", "sub-steps: 3", "landmarks held back
/// 2.1 mm", "injective again". A change is told when it is seen, the state that lasts always; but of many changes only
/// kBurst at once and then one a second of simulated time, with the number passed over, so that a shaking needle
/// does not flood. No clock: the same states give the same events. Threads: one, the snapshot thread.
class GuardEvents {
 public:
  /// The text of the warning that `state` calls for; none where nothing changed or it has to wait.
  std::optional<std::string> update(const MeshState& state);

 private:
  static constexpr double kPerSecond = 1;
  static constexpr double kBurst = 4;

  struct Guard {  // what a change is a change of
    Verdict verdict = Verdict::kInjective;
    std::uint32_t actions = 0;
    bool operator==(const Guard&) const = default;
  };

  Guard seen_, told_;
  std::uint64_t passed_over_ = 0;
  net::RateLimit rate_{kPerSecond, kBurst};
};

}  // namespace brachy
