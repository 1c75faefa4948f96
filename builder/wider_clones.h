// Functions of hot loops, also compiled for wider vectors; the one that runs is chosen when the program
// starts. They round alike, since nothing is fused: results do not depend on the processor.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define WIDER_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define WIDER_CLONES
#endif
