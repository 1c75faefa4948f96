#include "viewer/web/wasm/band_caster.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "render/frame_setup.h"
#include "render/host/layer_tiles.h"

namespace vcp {

namespace {

/// By so many rows bands overlap where occlusion is averaged over neighbours: a whole square of 4 x 4 directions, and
/// whole tiles.
constexpr uint32_t kOverlap = kTileHeight;

/// The part of a picture that is cast for some of its rows.
FrameRequest requestOfRows(const FrameRequest& whole, uint32_t first, uint32_t count) {
    const uint32_t by = whole.shading.occlusionRays > 0 ? kOverlap : 0;
    const uint32_t begin = first - std::min(first, by), end = std::min(whole.height, first + count + by);
    FrameRequest part = whole;
    part.height = end - begin;
    part.tile = PictureTile{0, begin, whole.width, whole.height};
    return part;
}

HostLayer layerOf(const CutScene& cut, const FrameRequest& part, const Dataset& dataset, bool withColour,
                  double errorPixels, PictureMarks* marks) {
    return {.scene = cut.scene(),
            .rays = pictureRays(part),
            .frame = frameConstants(part, &dataset, 1, withColour, errorPixels),
            .hasColour = withColour,
            .hasChannels = part.shading.channels,
            .caps = capsOf(part, dataset),
            .marks = marks};
}

template <class Item>
void append(std::vector<Item>& to, const std::vector<Item>& more) {
    to.insert(to.end(), more.begin(), more.end());
}

}  // namespace

void BandsSaid::add(const BandsSaid& other) {
    append(hit.byCamera, other.hit.byCamera);
    append(hit.byLight, other.hit.byLight);
    append(feedback.hits, other.feedback.hits);
    append(feedback.passed, other.feedback.passed);
}

uint32_t BandCaster::rowsOf(const FrameRequest& request) {
    return request.shading.occlusionRays > 0 ? kRowsWithOcclusion : kRows;
}

uint32_t BandCaster::bandsOf(const FrameRequest& request) {
    return (request.height + rowsOf(request) - 1) / rowsOf(request);
}

BandCaster::Rows BandCaster::rowsOf(uint32_t band) const {
    const uint32_t rows = rowsOf(frame_.request), first = band * rows;
    return {first, std::min(rows, frame_.request.height - first)};
}

Result<void> BandCaster::begin(const Dataset& dataset, bool withColour, const BandFrame& frame,
                               std::vector<CutPage> cut) {
    dataset_ = &dataset;
    withColour_ = withColour;
    frame_ = frame;
    scene_.reset();
    VCP_TRY_ASSIGN(scene_, CutScene::create(dataset.header, withColour, std::move(cut)));
    scene_->showImages(frame.images);
    marks_.reset();
    if (frame.asksRays) marks_.emplace(scene_->scene().pages());
    feedback_ = {};
    if (frame.request.sample > 0) return {};
    kept_.clear();
    kept_.resize(bandsOf(frame.request));
    return {};
}

void BandCaster::cast(uint32_t band) {
    const Rows rows = rowsOf(band);
    const FrameRequest part = requestOfRows(frame_.request, rows.first, rows.count);
    const uint32_t above = rows.first - part.tile->y;
    HostPicture picture({int(part.width), int(part.height)}, backgroundRows(part));
    const HostLayer layer =
        layerOf(*scene_, part, *dataset_, withColour_, frame_.errorPixels, marks_ ? &*marks_ : nullptr);
    // Without a function that cancels it, nothing can go wrong.
    static_cast<void>(drawLayer(layer, {}, picture));
    if (frame_.listens) {
        const RayFeedback more =
            feedbackOf(layer, *dataset_, picture,
                       {int(part.tile->y), int(rows.first), int(rows.first + rows.count), int(frame_.request.height)});
        append(feedback_.hits, more.hits);
        append(feedback_.passed, more.passed);
    }
    last_ = band;
    const size_t from = size_t(above) * part.width, count = size_t(rows.count) * part.width;
    keep(std::span(picture.colours).subspan(from, count), kept_[band]);
    depth_.assign(picture.depth.begin() + std::ptrdiff_t(from), picture.depth.begin() + std::ptrdiff_t(from + count));
}

void BandCaster::keep(std::span<const uint32_t> colours, Kept& kept) const {
    if (frame_.request.sample == 0) {
        kept.colours.assign(colours.begin(), colours.end());
        return;
    }
    if (kept.light.samples() == 0) {
        kept.light = SampledLight(colours.size());
        kept.light.add(kept.colours);
        std::vector<uint32_t>().swap(kept.colours);
    }
    kept.light.add(colours);
}

std::span<const uint32_t> BandCaster::colours() {
    const Kept& kept = kept_[last_];
    if (kept.light.samples() == 0) return kept.colours;
    mean_ = kept.light.mean();
    return mean_;
}

BandsSaid BandCaster::said() const {
    BandsSaid said;
    if (marks_) said.hit = {scene_->marked(marks_->byCamera), scene_->marked(marks_->byLight)};
    said.feedback = feedback_;
    return said;
}

float depthAt(const Dataset& dataset, const FrameRequest& request, std::vector<CutPage> cut, bool withColour,
              uint32_t x, uint32_t y) {
    const uint32_t rows = BandCaster::rowsOf(request), first = y / rows * rows;
    const FrameRequest part = requestOfRows(request, first, std::min(rows, request.height - first));
    constexpr float kNothing = std::numeric_limits<float>::infinity();
    const auto scene = CutScene::create(dataset.header, withColour, std::move(cut));
    if (!scene) return kNothing;
    const HostLayer layer = layerOf(*scene, part, dataset, withColour, 0, nullptr);
    const glm::ivec2 pixel(int(x), int(y - part.tile->y)), tile(kTileWidth, kTileHeight);
    TileHits hits;
    hits.corner = pixel / tile * tile;
    LayerTiles(layer, {int(part.width), int(part.height)}).cast(hits);
    const glm::ivec2 in = pixel - hits.corner;
    return hits.any ? hits.depth[in.y * kTileWidth + in.x] : kNothing;
}

}  // namespace vcp
