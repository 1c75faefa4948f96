#include "octree/io/content_hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace vcp {

uint64_t hashBytes(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

}  // namespace vcp
