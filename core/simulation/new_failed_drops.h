#pragma once

#include <algorithm>
#include <cstdint>

#include "core/simulation/mesh_state.h"

namespace brachy {

/// Calls `visit` with each failed drop from number `seen` on that is still kept, and sets `seen` to their count. Fewer
/// than were seen: another run, which has had none yet. Real-time: as `visit`.
template <class Visit>
void visit_new(const FailedDrops& drops, std::uint64_t& seen, const Visit& visit) {
  const std::uint64_t first_kept = drops.count - std::min<std::uint64_t>(drops.count, FailedDrops::kKept);
  seen = std::clamp(seen, first_kept, drops.count);
  for (; seen < drops.count; ++seen) visit(drops.slots[seen % FailedDrops::kKept]);
}

}  // namespace brachy
