#pragma once

#include <cstdint>

namespace brachy::test {

/// Allocations made by this thread so far, through new or malloc. Always 0 where the sanitizers own malloc.
std::uint64_t allocation_count();
/// Whether allocation_count counts.
bool allocations_are_counted();

}  // namespace brachy::test
