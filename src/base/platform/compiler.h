#pragma once

/// What a compiler offers beyond the standard. Each is a plain word of C++, or nothing, where it has none:
/// results are the same, only slower. ITS_PLAIN asks for that everywhere.

#if defined(__GNUC__) && !defined(ITS_PLAIN)
/// For what a clone calls: only inlined code is compiled for its instruction set.
#define ITS_INLINE inline __attribute__((always_inline))
/// A pointer or reference whose target nothing else in the function refers to.
#define ITS_RESTRICT __restrict
#else
#define ITS_INLINE inline
#define ITS_RESTRICT
#endif

/// ITS_CLONES: compile a hot function for several instruction sets and pick one when the program starts. All
/// give the same bits: nothing is reassociated or contracted. Off where the tools cannot follow (sanitizers).
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(ITS_SANITIZED) && \
    !defined(ITS_PLAIN)
#define ITS_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define ITS_CLONES
#endif

/// Before a loop no iteration of which reads what another one writes.
#if defined(__GNUC__) && !defined(__clang__) && !defined(ITS_PLAIN)
#define ITS_INDEPENDENT _Pragma("GCC ivdep")
#else
#define ITS_INDEPENDENT
#endif

/// Asks for a cache line that will be read, or written, soon.
#if defined(__GNUC__) && !defined(ITS_PLAIN)
#define ITS_PREFETCH_TO_READ(address) __builtin_prefetch(address)
#define ITS_PREFETCH_TO_WRITE(address) __builtin_prefetch(address, 1)
#else
#define ITS_PREFETCH_TO_READ(address) ((void)(address))
#define ITS_PREFETCH_TO_WRITE(address) ((void)(address))
#endif
