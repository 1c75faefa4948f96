#include "octree/io/content_hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace vcp {

uint64_t hashBytes(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

struct ContentHash::State {
    XXH3_state_t of;
};

ContentHash::ContentHash() : state_(std::make_unique<State>()) { XXH3_64bits_reset(&state_->of); }
ContentHash::~ContentHash() = default;
ContentHash::ContentHash(ContentHash&&) noexcept = default;

void ContentHash::add(std::span<const std::byte> bytes) { XXH3_64bits_update(&state_->of, bytes.data(), bytes.size()); }

uint64_t ContentHash::value() const { return XXH3_64bits_digest(&state_->of); }

}  // namespace vcp
