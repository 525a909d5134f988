#include "apps/daemon/io/work_turns.h"

#include <algorithm>
#include <utility>

namespace brachy {

bool WorkTurns::add(std::uint64_t peer, Prepare prepare) {
  if (std::ranges::find(waiting_, peer, &Piece::peer) != waiting_.end()) return false;
  waiting_.push_back({peer, std::move(prepare)});
  if (waiting_.size() == 1) begin();
  return true;
}

void WorkTurns::begin() {
  while (!waiting_.empty()) {
    Work work = std::exchange(waiting_.front().prepare, nullptr)();
    if (work) {
      worker_.post([this, work = std::move(work)] {
        loop_.post([this, finish = work()] {
          finish();
          waiting_.pop_front();
          begin();
        });
      });
      return;
    }
    waiting_.pop_front();
  }
}

}  // namespace brachy
