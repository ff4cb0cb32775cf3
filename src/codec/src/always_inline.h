#pragma once

/// Before a small function that is called for every sample: it must not cost a call.
#define TERRANE_INLINE __attribute__((always_inline)) inline
/// After the parameters of such a lambda.
#define TERRANE_INLINE_LAMBDA __attribute__((always_inline))
