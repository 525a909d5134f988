#include "tests/core/simulation/allocation_guard.h"

#include <cstdlib>

#include "tests/sanitized.h"

#if defined(__GLIBC__) && !BRACHY_ADDRESS_SANITIZER && !BRACHY_THREAD_SANITIZER

// malloc and related functions, interposed before glibc's: operator new and Eigen both call these.
namespace {
thread_local std::uint64_t allocations = 0;
}

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* p, std::size_t size) {
  ++allocations;
  return __libc_realloc(p, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return memalign(alignment, size);
}
int posix_memalign(void** p, std::size_t alignment, std::size_t size) {
  *p = memalign(alignment, size);
  return *p ? 0 : 12;  // ENOMEM
}
}

namespace brachy::test {
std::uint64_t allocation_count() {
  return allocations;
}
bool allocations_are_counted() {
  return true;
}
}  // namespace brachy::test

#else

namespace brachy::test {
std::uint64_t allocation_count() {
  return 0;
}
bool allocations_are_counted() {
  return false;
}
}  // namespace brachy::test

#endif
