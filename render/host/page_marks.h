// Which pages of a scene the rays of a picture hit, or begin in. Any thread may mark a page.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace vcp {

class PageMarks {
public:
    explicit PageMarks(size_t pages) : isMarked_(pages) {}

    /// `page`: index in the scene.
    void mark(uint32_t page) {
        // Most are marked already, and reading leaves the other processors' caches alone.
        if (!isMarked(page)) isMarked_[page].store(true, std::memory_order_relaxed);
    }
    [[nodiscard]] bool isMarked(size_t page) const { return isMarked_[page].load(std::memory_order_relaxed); }

private:
    std::vector<std::atomic<bool>> isMarked_;
};

/// The marks of rays of the camera, and of rays of light.
struct PictureMarks {
    explicit PictureMarks(size_t pages) : byCamera(pages), byLight(pages) {}

    PageMarks byCamera, byLight;
};

}  // namespace vcp
