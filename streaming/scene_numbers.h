// Numbers for what several datasets hold, on end: the pages of the first dataset have their own numbers, those of the
// second follow, and so on; likewise the blocks of their directories. Pure.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "streaming/request.h"

namespace vcp {

class SceneNumbers {
public:
    /// Adds a dataset of so many pages and blocks behind those before.
    void add(uint64_t pages, uint64_t blocks) {
        pages_.push_back(pages_.back() + pages);
        blocks_.push_back(blocks_.back() + blocks);
    }

    [[nodiscard]] size_t datasets() const { return pages_.size() - 1; }
    [[nodiscard]] uint64_t pages() const { return pages_.back(); }
    [[nodiscard]] uint64_t firstPage(size_t dataset) const { return pages_[dataset]; }
    /// Returns which dataset holds it. Precondition: one does.
    [[nodiscard]] size_t datasetOf(Request request) const {
        const std::vector<uint64_t>& ends = request.isPage() ? pages_ : blocks_;
        return size_t(std::upper_bound(ends.begin() + 1, ends.end(), request.number) - ends.begin()) - 1;
    }
    /// Returns what a dataset's own number is in the scene, and what a number in the scene is in its dataset.
    [[nodiscard]] Request inScene(size_t dataset, Request own) const { return own.after(firstOf(dataset, own)); }
    [[nodiscard]] Request inDataset(Request request) const {
        request.number -= firstOf(datasetOf(request), request);
        return request;
    }
    /// Whether the page is the coarsest of its dataset.
    [[nodiscard]] bool isCoarsest(uint64_t page) const {
        return page == 0 || std::binary_search(pages_.begin(), pages_.end(), page);
    }

private:
    [[nodiscard]] uint64_t firstOf(size_t dataset, Request request) const {
        return request.isPage() ? pages_[dataset] : blocks_[dataset];
    }

    std::vector<uint64_t> pages_{0}, blocks_{0};  // where each dataset begins, and the end of the last
};

}  // namespace vcp
