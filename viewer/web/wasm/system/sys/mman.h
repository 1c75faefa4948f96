// Address space without memory, as far as WebAssembly has it: memory that is zero. Its pages are the browser's, which
// gives them when something is written.
#pragma once

#include <cstdlib>

#define PROT_READ 1
#define PROT_WRITE 2
#define MAP_PRIVATE 2
#define MAP_ANONYMOUS 32
#define MAP_NORESERVE 16384
#define MAP_FAILED (reinterpret_cast<void*>(-1))
#define MADV_NOHUGEPAGE 15

inline void* mmap(void*, size_t bytes, int, int, int, long) { return std::calloc(bytes, 1); }
inline int munmap(void* memory, size_t) { return std::free(memory), 0; }
inline int madvise(void*, size_t, int) { return 0; }
