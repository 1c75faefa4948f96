// Where the pages of a scene come from: the sources of its datasets as one, so that one loader reads for all of them.
#pragma once

#include <memory>
#include <vector>

#include "octree/dataset_reader.h"
#include "streaming/page_source.h"
#include "streaming/scene_numbers.h"

namespace vcp {

class SceneSource final : public PageSource {
public:
    struct Part {
        std::shared_ptr<const Dataset> dataset;
        std::shared_ptr<const PageSource> source;
        std::shared_ptr<const ImagePieces> images = {};  ///< of the source; null: no pieces are asked for
    };
    explicit SceneSource(std::vector<Part> parts);

    [[nodiscard]] const SceneNumbers& numbers() const { return numbers_; }

    Result<PageBytes> read(Request request, bool withColour) const override;
    std::vector<Result<PageBytes>> readRun(Request first, uint32_t count, bool withColour) const override;
    [[nodiscard]] uint32_t runFrom(Request first, uint32_t most, bool withColour) const override;
    [[nodiscard]] uint64_t bytesToRead(Request request, bool withColour) const override;
    /// Sources keep what they have while there is room, and share evenly what is left.
    uint64_t keepWithin(uint64_t bytes) const override;
    [[nodiscard]] uint32_t partOf(Request request) const override { return uint32_t(numbers_.datasetOf(request)); }
    void interrupt() const override;
    [[nodiscard]] PageOrigin originOf(Request request) const override;

private:
    [[nodiscard]] const PageSource& sourceOf(Request request) const {
        return *parts_[numbers_.datasetOf(request)].source;
    }

    std::vector<Part> parts_;
    SceneNumbers numbers_;
    mutable std::vector<uint64_t> limits_;  // what each source may keep; only the loader's keepWithin() touches it
};

}  // namespace vcp
