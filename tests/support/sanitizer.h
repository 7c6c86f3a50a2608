// Whether a sanitizer runs with the test: it keeps what was freed, and its code takes many times as long.
#pragma once

namespace sixpoint::testing {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

// How many times longer a call that computes may take.
inline constexpr double kPatience = kSanitized ? 10 : 1;

}  // namespace sixpoint::testing
