#include "net/session/frame_cache.h"

namespace brachy::net {

void FrameCache::update(std::shared_ptr<const MeshState> state) {
  state_ = std::move(state);
  ++snapshots_;
  bodies_.clear();
}

std::shared_ptr<const Bytes> FrameCache::body(FrameRequest request) {
  if (request.full && !request.pose_history)
    request.after_tick = 0;  // does not matter then: one body for all
  auto& body = bodies_[request];
  if (!body) {
    Bytes bytes;
    encode_frame(*state_, request.surface ? surface_ : volume_, snapshots_, request, bytes);
    body = std::make_shared<const Bytes>(std::move(bytes));
    ++encoded_;
  }
  return body;
}

}  // namespace brachy::net
