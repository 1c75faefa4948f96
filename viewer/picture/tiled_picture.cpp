#include "viewer/picture/tiled_picture.h"

#include <algorithm>
#include <utility>

namespace vcp {

namespace {

// The shade pass averages over 2 pixels around; squares of 4 x 4 pixels and tiles of 8 x 8 stay aligned.
constexpr uint32_t kOverlap = 8;

/// Copies the part of a tile's pixels that `inner` covers, `words` values each, into a band.
template <class Value, class Rect>
void copyInto(std::vector<Value>& band, uint32_t bandWidth, const std::vector<Value>& pixels, const Rect& outer,
              const Rect& inner, uint32_t words) {
    for (uint32_t row = 0; row < inner.height; ++row) {
        const uint64_t from = uint64_t{inner.y - outer.y + row} * outer.width + (inner.x - outer.x);
        const auto* begin = pixels.data() + from * words;
        std::copy(begin, begin + uint64_t{inner.width} * words,
                  band.data() + (uint64_t{row} * bandWidth + inner.x) * words);
    }
}

}  // namespace

TiledPicture::Rect TiledPicture::inner() const {
    return {x_, y_, std::min(options_.tile, whole_.width - x_), std::min(options_.tile, whole_.height - y_)};
}

/// Returns the tile with the pixels around it that are averaged over, within the whole.
TiledPicture::Rect TiledPicture::outer() const {
    const uint32_t by = whole_.shading.occlusionRays > 0 ? kOverlap : 0;
    const Rect r = inner();
    const uint32_t x = r.x - std::min(r.x, by), y = r.y - std::min(r.y, by);
    return {x, y, std::min(whole_.width, r.x + r.width + by) - x, std::min(whole_.height, r.y + r.height + by) - y};
}

double TiledPicture::fraction() const {
    const double rows = double(y_) * whole_.width;
    const double inRow = y_ < whole_.height ? double(x_) * inner().height : 0;
    return (rows + inRow) / (double(whole_.width) * whole_.height);
}

Result<bool> TiledPicture::step() {
    if (y_ >= whole_.height) return true;
    const Rect tile = inner(), with = outer();
    FrameRequest request = whole_;
    request.width = with.width;
    request.height = with.height;
    if (with.width != whole_.width || with.height != whole_.height)
        request.tile = {with.x, with.y, whole_.width, whole_.height};
    VCP_TRY_ASSIGN(auto update, renderer_->update(request));
    if (!update.problems.empty() && !options_.problem) return update.problems.front();
    for (const Error& problem : update.problems) options_.problem(problem);
    if (update.changed) drawn_.reset();
    isWaiting_ = !update.settled && !update.awaitsRays;
    if (isWaiting_) return false;
    if (!drawn_ || update.awaitsRays) {
        VCP_TRY_ASSIGN(drawn_, renderer_->render(request, options_.cancel));
    }
    if (!update.settled) return false;  // what its rays hit may be too coarse
    stats_.errorPixels = std::max(stats_.errorPixels, update.errorPixels);
    stats_.update = std::move(update);
    count(*std::exchange(drawn_, std::nullopt));
    VCP_TRY(copyTile(with, tile));
    x_ += tile.width;
    if (x_ < whole_.width) return false;
    VCP_TRY(take_(band_));
    band_ = {};
    x_ = 0;
    y_ += tile.height;
    return y_ >= whole_.height;
}

void TiledPicture::count(const FrameStats& tile) {
    ++stats_.tiles;
    stats_.rays += tile.rays;
    stats_.hitPixels += tile.hitPixels;
    stats_.ms += tile.msFrame;
}

Result<void> TiledPicture::copyTile(const Rect& outer, const Rect& inner) {
    if (inner.x == 0) {
        const uint64_t pixels = uint64_t{whole_.width} * inner.height;
        band_.picture = {whole_.width, inner.height, std::vector<uint8_t>(4 * pixels)};
        band_.depth.resize(options_.depth ? pixels : 0);
        band_.normals.resize(options_.normals ? pixels : 0);
    }
    VCP_TRY_ASSIGN(const auto picture, renderer_->readPicture());
    copyInto(band_.picture.rgba, whole_.width, picture.rgba, outer, inner, 4);
    if (options_.depth) {
        VCP_TRY_ASSIGN(const auto depth, renderer_->readDepth());
        copyInto(band_.depth, whole_.width, depth, outer, inner, 1);
    }
    if (options_.normals) {
        VCP_TRY_ASSIGN(const auto normals, renderer_->readNormals());
        copyInto(band_.normals, whole_.width, normals, outer, inner, 1);
    }
    return {};
}

}  // namespace vcp
