#include "tests/faults/largest_allocation.h"

#include <algorithm>
#include <cstdlib>
#include <new>

// Replaces the library's operator new, for the code under test, Asio and Beast. Over-aligned allocations, of which net
// has none, are not counted.
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
