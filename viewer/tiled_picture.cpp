#include "viewer/tiled_picture.h"

#include <algorithm>
#include <utility>

namespace vcp {

namespace {

// What the shade pass averages over reaches 2 pixels far; squares of 4 x 4 pixels and tiles of 8 x 8 stay in step.
constexpr uint32_t kOverlap = 8;

struct Rect {
    uint32_t x, y, width, height;
};

/// The rectangle and some about it, within the whole.
Rect widened(const Rect& r, uint32_t by, const FrameRequest& whole) {
    const uint32_t x = r.x - std::min(r.x, by), y = r.y - std::min(r.y, by);
    return {x, y, std::min(whole.width, r.x + r.width + by) - x, std::min(whole.height, r.y + r.height + by) - y};
}

/// Copies what `inner` covers of a tile's pixels, `words` values each, into a band.
template <class Value>
void copyInto(std::vector<Value>& band, uint32_t bandWidth, const std::vector<Value>& pixels, const Rect& outer, const Rect& inner, uint32_t words) {
    for (uint32_t row = 0; row < inner.height; ++row) {
        const uint64_t from = uint64_t{inner.y - outer.y + row} * outer.width + (inner.x - outer.x);
        const auto* begin = pixels.data() + from * words;
        std::copy(begin, begin + uint64_t{inner.width} * words, band.data() + (uint64_t{row} * bandWidth + inner.x) * words);
    }
}

class TiledDrawing {
public:
    TiledDrawing(Renderer& renderer, const FrameRequest& whole, const TiledPictureOptions& options)
        : renderer_(&renderer), whole_(whole), options_(options), overlap_(whole.shading.occlusionRays > 0 ? kOverlap : 0) {}

    /// Draws `inner` into `band`, whose first row is inner.y.
    Result<void> draw(const Rect& inner, PictureBand& band) {
        const Rect outer = widened(inner, overlap_, whole_);
        FrameRequest request = whole_;
        request.width = outer.width;
        request.height = outer.height;
        if (outer.width != whole_.width || outer.height != whole_.height) request.tile = {outer.x, outer.y, whole_.width, whole_.height};
        auto update = renderer_->settle(request, [&] { return !goesOn(); });
        if (!update) return update.error();
        if (!update->problems.empty()) return update->problems.front();
        const auto stats = renderer_->render(request);
        if (!stats) return stats.error();
        ++stats_.tiles;
        stats_.rays += stats->rays;
        stats_.hitPixels += stats->hitPixels;
        stats_.ms += stats->msFrame;
        stats_.errorPixels = std::max(stats_.errorPixels, update->errorPixels);
        stats_.settled = stats_.settled && update->settled;
        stats_.update = *std::move(update);
        VCP_TRY(take(outer, inner, band));
        done_ += uint64_t{inner.width} * inner.height;
        return goesOn() ? Result<void>{} : Error{ErrorCode::Cancelled, "cancelled"};
    }

    [[nodiscard]] const TiledPictureStats& stats() const { return stats_; }

private:
    [[nodiscard]] bool goesOn() const {
        return !options_.progress || options_.progress(static_cast<double>(done_) / (static_cast<double>(whole_.width) * whole_.height));
    }

    Result<void> take(const Rect& outer, const Rect& inner, PictureBand& band) {
        const auto picture = renderer_->readPicture();
        if (!picture) return picture.error();
        copyInto(band.picture.rgba, whole_.width, picture->rgba, outer, inner, 4);
        if (options_.depth) {
            const auto depth = renderer_->readDepth();
            if (!depth) return depth.error();
            copyInto(band.depth, whole_.width, *depth, outer, inner, 1);
        }
        if (options_.normals) {
            const auto normals = renderer_->readNormals();
            if (!normals) return normals.error();
            copyInto(band.normals, whole_.width, *normals, outer, inner, 1);
        }
        return {};
    }

    Renderer* renderer_;
    const FrameRequest& whole_;
    const TiledPictureOptions& options_;
    uint32_t overlap_;
    uint64_t done_ = 0;
    TiledPictureStats stats_;
};

}  // namespace

Result<TiledPictureStats> drawTiled(Renderer& renderer, const FrameRequest& request, const TiledPictureOptions& options,
                                    const std::function<Result<void>(const PictureBand&)>& take) {
    TiledDrawing drawing(renderer, request, options);
    for (uint32_t y = 0; y < request.height; y += options.tile) {
        const uint32_t height = std::min(options.tile, request.height - y);
        const uint64_t pixels = uint64_t{request.width} * height;
        PictureBand band;
        band.picture = {request.width, height, std::vector<uint8_t>(4 * pixels)};
        if (options.depth) band.depth.resize(pixels);
        if (options.normals) band.normals.resize(pixels);
        for (uint32_t x = 0; x < request.width; x += options.tile)
            VCP_TRY(drawing.draw({x, y, std::min(options.tile, request.width - x), height}, band));
        VCP_TRY(take(band));
    }
    return drawing.stats();
}

}  // namespace vcp
