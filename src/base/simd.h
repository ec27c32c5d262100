#pragma once

/// ITS_CLONES: compile a hot function for several instruction sets and pick one when the program starts. All
/// give the same bits: nothing is reassociated or contracted. Off where the tools cannot follow (sanitizers).
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(ITS_SANITIZED)
#define ITS_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define ITS_CLONES
#endif

/// For what a clone calls: only inlined code is compiled for its instruction set.
#define ITS_INLINE inline __attribute__((always_inline))
