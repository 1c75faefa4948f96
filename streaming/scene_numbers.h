// Numbers for what several datasets hold, on end: the pages of the first dataset have their own numbers, those of the
// second follow, and so on; likewise the blocks of their directories and the pieces of their images. Pure.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "streaming/request.h"

namespace vcp {

class SceneNumbers {
public:
    /// Adds a dataset of so many pages, blocks and pieces behind those before.
    void add(uint64_t pages, uint64_t blocks, uint64_t pieces = 0) {
        const uint64_t counts[] = {pages, blocks, pieces};
        for (size_t kind = 0; kind < ends_.size(); ++kind) ends_[kind].push_back(ends_[kind].back() + counts[kind]);
    }

    [[nodiscard]] size_t datasets() const { return endsOf({}).size() - 1; }
    [[nodiscard]] uint64_t pages() const { return endsOf({}).back(); }
    [[nodiscard]] uint64_t firstPage(size_t dataset) const { return endsOf({})[dataset]; }
    /// Returns which dataset holds it. Precondition: one does.
    [[nodiscard]] size_t datasetOf(Request request) const {
        const std::vector<uint64_t>& ends = endsOf(request);
        return size_t(std::upper_bound(ends.begin() + 1, ends.end(), request.number) - ends.begin()) - 1;
    }
    /// Returns what a dataset's own number is in the scene, and what a number in the scene is in its dataset.
    [[nodiscard]] Request inScene(size_t dataset, Request own) const { return own.after(endsOf(own)[dataset]); }
    [[nodiscard]] Request inDataset(Request request) const {
        request.number -= endsOf(request)[datasetOf(request)];
        return request;
    }
    /// Whether the page is the coarsest of its dataset.
    [[nodiscard]] bool isCoarsest(uint64_t page) const {
        return page == 0 || std::binary_search(endsOf({}).begin(), endsOf({}).end(), page);
    }

private:
    /// Returns where each dataset begins among what is like `request`, and the end of the last.
    [[nodiscard]] const std::vector<uint64_t>& endsOf(Request request) const { return ends_[size_t(request.kind)]; }

    std::array<std::vector<uint64_t>, 3> ends_{{{0}, {0}, {0}}};  // by Request::Kind
};

}  // namespace vcp
