#include "viewer/picture/tiled_picture.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "render/pixel_samples.h"

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
    if (y_ >= whole_.height) return 1;
    const Rect tile = inner();
    const double inTile = double(samples_) / samplesOf(whole_, options_.samples) * tile.width * tile.height;
    return (rows + double(x_) * tile.height + inTile) / (double(whole_.width) * whole_.height);
}

FrameRequest TiledPicture::tileRequest() const {
    const Rect with = outer();
    FrameRequest request = whole_;
    request.width = with.width;
    request.height = with.height;
    if (with.width != whole_.width || with.height != whole_.height)
        request.tile = {with.x, with.y, whole_.width, whole_.height};
    return request;
}

Result<bool> TiledPicture::step() {
    if (y_ >= whole_.height) return true;
    const FrameRequest request = tileRequest();
    if (samples_ > 0) {
        VCP_TRY(addSample());
    } else {
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
        stats_.colourPixels = std::max(stats_.colourPixels, update.colourPixels);
        stats_.update = std::move(update);
        begin(*std::exchange(drawn_, std::nullopt));
    }
    if (samples_ < samplesOf(request, options_.samples)) return false;
    const Rect tile = inner();
    VCP_TRY(copyTile(outer(), tile));
    ++stats_.tiles;
    stats_.hitPixels += tileHits_;
    samples_ = 0;
    x_ += tile.width;
    if (x_ < whole_.width) return false;
    VCP_TRY(take_(band_));
    band_ = {};
    x_ = 0;
    y_ += tile.height;
    return y_ >= whole_.height;
}

void TiledPicture::begin(const FrameStats& tile) {
    samples_ = 1;
    tileHits_ = tile.hitPixels;
    stats_.rays += tile.rays;
    stats_.ms += tile.msFrame;
    stats_.remeshedPixels = std::max(stats_.remeshedPixels, tile.remeshedPixels);
    stats_.uncertifiedPatches = std::max(stats_.uncertifiedPatches, tile.uncertifiedPatches);
    stats_.missingHeights = std::max(stats_.missingHeights, tile.missingHeights);
    stats_.onHost = tile.onHost;
}

/// Adds a sample to the tile; where it cannot go on, the next step draws it anew.
Result<void> TiledPicture::addSample() {
    const auto began = std::chrono::steady_clock::now();
    VCP_TRY_ASSIGN(samples_, renderer_->refine(options_.cancel));
    const Rect with = outer();
    stats_.rays += uint64_t{with.width} * with.height;
    stats_.ms += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count();
    return {};
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
