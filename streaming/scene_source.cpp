#include "streaming/scene_source.h"

#include <numeric>
#include <utility>

namespace vcp {

SceneSource::SceneSource(std::vector<Part> parts) : parts_(std::move(parts)), limits_(parts_.size()) {
    // There are no more pieces than tiles, whose rows stand in the section: so their tables need not be known yet.
    for (const Part& part : parts_)
        numbers_.add(part.dataset->pages.size(), part.dataset->pages.blocks(),
                     part.dataset->header.images.bytes / sizeof(TileRow));
}

Result<PageBytes> SceneSource::read(Request request, bool withColour) const {
    return sourceOf(request).read(numbers_.inDataset(request), withColour);
}

std::vector<Result<PageBytes>> SceneSource::readRun(Request first, uint32_t count, bool withColour) const {
    return sourceOf(first).readRun(numbers_.inDataset(first), count, withColour);
}

uint32_t SceneSource::runFrom(Request first, uint32_t most, bool withColour) const {
    return sourceOf(first).runFrom(numbers_.inDataset(first), most, withColour);
}

uint64_t SceneSource::bytesToRead(Request request, bool withColour) const {
    return sourceOf(request).bytesToRead(numbers_.inDataset(request), withColour);
}

uint64_t SceneSource::keepWithin(uint64_t bytes) const {
    if (parts_.size() == 1) return parts_.front().source->keepWithin(bytes);
    std::vector<uint64_t> kept(parts_.size());
    for (size_t i = 0; i < parts_.size(); ++i) kept[i] = parts_[i].source->keepWithin(limits_[i]);
    const uint64_t all = std::accumulate(kept.begin(), kept.end(), uint64_t{0});
    std::vector<uint64_t> limits(parts_.size());
    for (size_t i = 0; i < parts_.size(); ++i)
        limits[i] = all <= bytes ? kept[i] + (bytes - all) / parts_.size()
                                 : uint64_t(double(kept[i]) / double(all) * double(bytes));
    // Who keeps less goes first: together they never keep more than they may.
    for (const bool shrinks : {true, false})
        for (size_t i = 0; i < parts_.size(); ++i)
            if ((limits[i] < limits_[i]) == shrinks) kept[i] = parts_[i].source->keepWithin(limits[i]);
    limits_ = std::move(limits);
    return std::accumulate(kept.begin(), kept.end(), uint64_t{0});
}

void SceneSource::interrupt() const {
    for (const Part& part : parts_) part.source->interrupt();
}

PageOrigin SceneSource::originOf(Request request) const {
    return sourceOf(request).originOf(numbers_.inDataset(request));
}

}  // namespace vcp
