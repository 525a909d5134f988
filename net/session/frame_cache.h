#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <utility>

#include "net/wire/frame_encoder.h"

namespace brachy::net {

/// The newest snapshot and the FRAME bodies made of it: each distinct request is encoded once and shared by all
/// clients. One thread.
class FrameCache {
 public:
  /// Of all points, and of the surface's alone.
  FrameCache(FrameLayout volume, FrameLayout surface)
      : volume_(std::move(volume)), surface_(std::move(surface)) {}

  /// A new snapshot; bodies of the previous one are released (senders keep what they are sending).
  void update(std::shared_ptr<const MeshState> state);

  bool has_snapshot() const { return state_ != nullptr; }
  std::uint64_t run() const { return state_ ? state_->summary.run : 0; }
  std::uint64_t tick() const { return state_ ? state_->summary.tick : 0; }
  std::uint64_t snapshots() const { return snapshots_; }  ///< also the sequence of the newest
  std::uint64_t encoded() const { return encoded_; }      ///< bodies encoded since start

  /// Precondition: has_snapshot(), and after_tick is not later than tick().
  std::shared_ptr<const Bytes> body(FrameRequest request);

 private:
  const FrameLayout volume_, surface_;
  std::shared_ptr<const MeshState> state_;
  std::uint64_t snapshots_ = 0;
  std::uint64_t encoded_ = 0;
  std::map<FrameRequest, std::shared_ptr<const Bytes>> bodies_;
};

}  // namespace brachy::net
