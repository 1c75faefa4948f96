// Functions of hot loops, also compiled for wider vectors; the one that runs is chosen when the program
// starts. They round alike, since nothing is fused: results do not depend on the processor. None under the thread
// sanitizer, which is not there yet when they are chosen.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define WIDER_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define WIDER_CLONES
#endif
