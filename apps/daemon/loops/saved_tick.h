#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/simulation/simulator.h"

namespace brachy {

/// A tick and the simulator's state after it, for a session to keep.
struct SavedTick {
  SavedTick() = default;
  /// With space for every state of this simulator, so that saving one does not allocate: needles in the tissue and
  /// seeds make it larger than it is at rest, by far less than this.
  explicit SavedTick(const Simulator& simulator) {
    simulator.save(bytes);
    capacity_ = 2 * bytes.size() + kMoreBytes;
    bytes.reserve(capacity_);
  }
  SavedTick(const SavedTick& other) : tick(other.tick), capacity_(other.capacity_) {
    bytes.reserve(capacity_);
    bytes.assign(other.bytes.begin(), other.bytes.end());
  }
  SavedTick& operator=(const SavedTick&) = delete;

  std::uint64_t tick = 0;
  std::vector<std::byte> bytes;

 private:
  static constexpr std::size_t kMoreBytes = 1 << 20;
  std::size_t capacity_ = 0;
};

}  // namespace brachy
