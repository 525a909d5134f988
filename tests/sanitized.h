#pragma once

namespace brachy::test {

/// Whether this is a build under a sanitizer, where arithmetic is ten to thirty times slower: tests that do nothing but
/// compute leave their largest cases to the release build.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

}  // namespace brachy::test
