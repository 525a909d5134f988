#pragma once

#include <cstddef>

namespace brachy::test {

/// The largest request that operator new has had since the last call of forget_allocations(), in bytes.
std::size_t largest_allocation();
void forget_allocations();

}  // namespace brachy::test
