// Compiles functions of hot loops also for wider vectors; the clone that runs is chosen when the program starts. All
// round alike, since nothing is fused: results do not depend on the processor. There are no clones under the thread
// sanitizer, which is not yet loaded when they are chosen.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define WIDER_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define WIDER_CLONES
#endif
