#pragma once

/// Before a function of loops over rows: it is compiled for several generations of processors, where that is
/// possible, and the right one is taken at run time. Whole numbers, or floats in a fixed order: all agree.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define TERRANE_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define TERRANE_CLONES
#endif
