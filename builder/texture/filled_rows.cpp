#include "builder/texture/filled_rows.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <glm/common.hpp>

#include "builder/texture/texel_light.h"

namespace vcp {

namespace {

constexpr uint32_t kMostBlocks = 256, kLeastBlockEdge = 8;  // along an edge of the image; texels
constexpr uint64_t kBlockBytes = (sizeof(TexelLight) + sizeof(Rgba8)) * kMostBlocks * kMostBlocks;

/// The light of blocks of an image, of their texels by their alpha.
struct Blocks {
    glm::uvec2 size;
    std::vector<TexelLight> lights;

    explicit Blocks(glm::uvec2 of) : size(of), lights(size_t{of.x} * of.y) {}
    TexelLight& at(uint32_t x, uint32_t y) { return lights[size_t{y} * size.x + x]; }
};

void add(TexelLight& sum, const TexelLight& other) {
    for (size_t c = 0; c < sum.size(); ++c) sum[c] += other[c];
}

/// Gives blocks that have no light that of the least larger block that has any.
void fillEmpty(Blocks& fine) {
    if (fine.lights.size() == 1) return;
    Blocks coarse((fine.size + 1u) / 2u);
    for (uint32_t y = 0; y < fine.size.y; ++y)
        for (uint32_t x = 0; x < fine.size.x; ++x) add(coarse.at(x / 2, y / 2), fine.at(x, y));
    fillEmpty(coarse);
    for (uint32_t y = 0; y < fine.size.y; ++y)
        for (uint32_t x = 0; x < fine.size.x; ++x)
            if (!(fine.at(x, y)[3] > 0)) fine.at(x, y) = coarse.at(x / 2, y / 2);
}

class FilledRows final : public ImageRows {
public:
    FilledRows(std::unique_ptr<ImageRows> image, std::function<Result<std::unique_ptr<ImageRows>>()> open)
        : image_(std::move(image)), open_(std::move(open)), size_(image_->size()) {
        const uint32_t longest = std::max(size_.x, size_.y);
        edge_ = std::max(kLeastBlockEdge, (longest + kMostBlocks - 1) / kMostBlocks);
    }

    [[nodiscard]] glm::uvec2 size() const override { return size_; }
    [[nodiscard]] uint64_t heldBytes() const override {
        return image_->heldBytes() + kBlockBytes + uint64_t{size_.x} * sizeof(Rgba8);
    }
    Result<void> read(std::span<Rgba8> texels) override {
        if (fills_.empty()) VCP_TRY(findFills());
        VCP_TRY(image_->read(texels));
        for (size_t at = 0; at < texels.size(); at += size_.x, ++row_)
            for (uint32_t x = 0; x < size_.x; ++x)
                texels[at + x] = filled(texels[at + x], fills_[row_ / edge_ * across_ + x / edge_]);
        return {};
    }

private:
    static Rgba8 filled(Rgba8 texel, Rgba8 fill) {
        // What is more opaque keeps its colour: it may be glass, which is not cut.
        constexpr uint32_t kLeastAlpha = 64;
        const Rgba8 opaque = texel | Rgba8{255} << 24;
        const uint32_t alpha = texel >> 24;
        if (alpha >= kLeastAlpha) return opaque;
        if (alpha == 0) return fill;
        const double own = double(alpha) / kLeastAlpha;
        TexelLight sum{};
        addTexel(sum, opaque, own);
        addTexel(sum, fill, 1 - own);
        return encodedTexel(sum);
    }

    Result<void> findFills() {
        Blocks blocks((size_ + edge_ - 1u) / edge_);
        std::vector<Rgba8> row(size_.x);
        for (uint32_t y = 0; y < size_.y; ++y) {
            VCP_TRY(image_->read(row));
            for (uint32_t x = 0; x < size_.x; ++x) addTexel(blocks.at(x / edge_, y / edge_), row[x], 1);
        }
        fillEmpty(blocks);
        across_ = blocks.size.x;
        for (TexelLight& light : blocks.lights) {
            for (size_t c = 0; c < 3 && light[3] > 0; ++c) light[c] /= light[3];
            fills_.push_back(encodeRgba({light[0], light[1], light[2], 1}));
        }
        // Of two readers of one file, only one is held.
        image_.reset();
        VCP_TRY_ASSIGN(image_, open_());
        if (image_->size() != size_)
            return Error{.code = ErrorCode::InvalidInput, .message = "the picture changed while it was read"};
        return {};
    }

    std::unique_ptr<ImageRows> image_;
    std::function<Result<std::unique_ptr<ImageRows>>()> open_;
    glm::uvec2 size_;
    uint32_t edge_ = 1;         // of a block, in texels
    size_t across_ = 0;         // blocks
    std::vector<Rgba8> fills_;  // of blocks, row by row
    uint32_t row_ = 0;          // the next that is read
};

}  // namespace

std::unique_ptr<ImageRows> filledRows(std::unique_ptr<ImageRows> image,
                                      std::function<Result<std::unique_ptr<ImageRows>>()> open) {
    return std::make_unique<FilledRows>(std::move(image), std::move(open));
}

}  // namespace vcp
