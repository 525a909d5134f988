#pragma once

#include <cstddef>

namespace brachy {

/// Calls work(i, thread) for each i < `count` on `threads` threads, of which each takes every so many: which does what
/// depends on nothing else. Real-time: with one thread, because libgomp allocates at every parallel region, so that one
/// does not enter OpenMP at all.
template <class Work>
void share_out(std::size_t count, std::size_t threads, const Work& work) {
  if (threads <= 1) {
    for (std::size_t i = 0; i < count; ++i) work(i, std::size_t{0});
    return;
  }
#pragma omp parallel for schedule(static, 1) num_threads(static_cast <int>(threads))
  for (std::size_t thread = 0; thread < threads; ++thread)
    for (std::size_t i = thread; i < count; i += threads) work(i, thread);
}

}  // namespace brachy
