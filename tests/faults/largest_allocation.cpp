#include "tests/faults/largest_allocation.h"

#include <algorithm>
#include <cstdlib>
#include <new>

// In front of the library's own: the vectors and strings of what is tested end here, Asio's and Beast's too. Over-aligned
// ones, of which the net has none, do not.
namespace {
std::size_t largest = 0;
}

void* operator new(std::size_t size) {
  largest = std::max(largest, size);
  if (void* p = std::malloc(size ? size : 1)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}

namespace brachy::test {

std::size_t largest_allocation() {
  return largest;
}
void forget_allocations() {
  largest = 0;
}

}  // namespace brachy::test
