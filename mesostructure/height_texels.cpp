#include "mesostructure/height_texels.h"

#include <algorithm>

namespace vcp::meso {

bool operator==(const HeightTexels& a, const HeightTexels& b) { return std::ranges::equal(a.heights_, b.heights_); }

Result<HeightRows> HeightRows::create(glm::ivec2 size, const HeightStore& store) {
    HeightRows made;
    const uint64_t count = uint64_t(size.x) * uint64_t(size.y);
    if (count <= store.mostInMemory) {
        made.inMemory_.resize(count);
        return made;
    }
    VCP_TRY_ASSIGN(made.file_, FileMemory::create(count * sizeof(uint16_t), store.folder));
    return made;
}

Result<void> HeightRows::write(int row, std::span<const uint16_t> heights) {
    const size_t at = size_t(row) * heights.size();
    if (file_) return file_->write(at * sizeof(uint16_t), std::as_bytes(heights));
    std::ranges::copy(heights, inMemory_.begin() + std::ptrdiff_t(at));
    return {};
}

HeightTexels HeightRows::take() && {
    if (!file_) return std::move(inMemory_);
    const std::span<const std::byte> bytes = file_->bytes();
    return {std::move(file_), {reinterpret_cast<const uint16_t*>(bytes.data()), bytes.size() / sizeof(uint16_t)}};
}

}  // namespace vcp::meso
