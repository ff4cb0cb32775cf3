#pragma once

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define TERRANE_IS_SANITIZED 1
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define TERRANE_IS_SANITIZED 1
#endif

namespace terrane {

/// How often a test at random is repeated: where sanitizers make each round ten times as slow, a quarter as
/// often. All rounds are run in the release build.
template <class Count>
constexpr Count rounds(Count all) {
#ifdef TERRANE_IS_SANITIZED
  return (all + 3) / 4;
#else
  return all;
#endif
}

}  // namespace terrane
