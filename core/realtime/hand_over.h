#pragma once

#include "core/realtime/triple_buffer.h"

namespace brachy {

/// A triple buffer together with both its handles, for the object that owns all three: the newest T goes from
/// the one thread that uses `writer` to the one that uses `reader`.
///
/// Threads: as TripleBuffer; constructed before both threads start, destroyed after both. The handles lie on
/// cache lines of their own, so that neither thread slows the other.
///
/// Real-time: as TripleBuffer: wait-free, no allocation.
template <class T>
class HandOver {
  TripleBuffer<T> buffer_;

 public:
  using Writer = typename TripleBuffer<T>::Writer;
  using Reader = typename TripleBuffer<T>::Reader;

  /// All slots start as copies of `initial`.
  explicit HandOver(const T& initial = T()) : buffer_(initial) {}

  alignas(64) Writer writer = buffer_.writer();  ///< for the writing thread only
  alignas(64) Reader reader = buffer_.reader();  ///< for the reading thread only
};

}  // namespace brachy
