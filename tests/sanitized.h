#pragma once

// GCC defines a macro, clang has __has_feature; some headers define that for GCC, as 0.
#if defined(__SANITIZE_ADDRESS__)
#define BRACHY_ADDRESS_SANITIZER 1
#elif defined(__clang__)
#define BRACHY_ADDRESS_SANITIZER __has_feature(address_sanitizer)
#else
#define BRACHY_ADDRESS_SANITIZER 0
#endif
#if defined(__SANITIZE_THREAD__)
#define BRACHY_THREAD_SANITIZER 1
#elif defined(__clang__)
#define BRACHY_THREAD_SANITIZER __has_feature(thread_sanitizer)
#else
#define BRACHY_THREAD_SANITIZER 0
#endif

namespace brachy::test {

/// Whether this is a build under a sanitizer, where arithmetic is ten to thirty times slower: tests that do nothing but
/// compute leave their largest cases to the release build.
#if BRACHY_ADDRESS_SANITIZER || BRACHY_THREAD_SANITIZER
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

}  // namespace brachy::test
