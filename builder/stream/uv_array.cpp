#include "builder/stream/uv_array.h"

#include <string_view>

namespace vcp {

Result<void> UvArray::append(glm::vec2 uv) {
    tail_.push_back(uv);
    ++size_;
    if (tail_.size() < kBlock) return {};
    VCP_TRY(spool_.append({reinterpret_cast<const char*>(tail_.data()), kBlock * sizeof(glm::vec2)}));
    tail_.clear();
    return {};
}

Result<glm::vec2> UvArray::at(uint64_t number) {
    const uint64_t block = number / kBlock;
    const size_t item = number % kBlock;
    if (block == (size_ - tail_.size()) / kBlock) return tail_[item];
    Slot& slot = slots_[block % slots_.size()];
    if (slot.block != block) {
        slot.items.resize(kBlock);
        slot.block = ~uint64_t{0};
        constexpr size_t kBytes = kBlock * sizeof(glm::vec2);
        VCP_TRY(spool_.read(block * kBytes, reinterpret_cast<char*>(slot.items.data()), kBytes));
        slot.block = block;
    }
    return slot.items[item];
}

}  // namespace vcp
