// Pages that an instance has of another's pool, and how an instance tells another which pages of a cut it needs. The
// bytes were checked by the one whose they are, and instances run the same code: nothing is checked again.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "render/frame_request.h"
#include "render/host_layer.h"

namespace vcp {

/// A page of a cut as it is named to another instance.
struct CutRecord {
    uint64_t number = 0;
    PageEntry entry;
    uint32_t octants = 0;
    uint32_t bytes = 0;
    uint32_t address = 0;  ///< of its bytes, in the instance whose cut it is
    uint32_t reserved = 0;
};
static_assert(sizeof(CutRecord) == 104 && offsetof(CutRecord, bytes) == 92 && offsetof(CutRecord, address) == 96);

/// Says which pages of a cut rays may meet.
class PagesNeeded {
public:
    /// Returns, of a cut, those pages that are met by rays through `count` rows of the picture from `first` on. Rays of
    /// light, and those that look whether a section fills a point, go anywhere: then it is the whole cut.
    std::vector<CutRecord> of(const Dataset& dataset, const FrameRequest& request, const std::vector<CutPage>& cut,
                              uint32_t first, uint32_t count);

private:
    /// Returns the edge of a page's widest slab leaf, world units. Hits on slabs are blended with the leaves about
    /// them, so pages that near are needed.
    double widestSlab(const Dataset& dataset, const CutPage& page);

    std::unordered_map<uint64_t, double> widest_;  // of pages, by number
};

class PageCopies {
public:
    /// Returns where to put the bytes of a page, in place of those it had.
    std::byte* room(uint64_t number, uint32_t bytes);
    void drop(uint64_t number) { pages_.erase(number); }
    /// Returns a cut of pages that are there. Errors: Usage, where one is not.
    [[nodiscard]] Result<std::vector<CutPage>> cutOf(std::span<const CutRecord> records) const;

private:
    struct Copy {
        std::unique_ptr<std::byte[]> bytes;
        uint32_t count;
    };
    std::map<uint64_t, Copy> pages_;
};

}  // namespace vcp
