// Renderer: pictures that the processor casts where the device is one itself (host_drawing.h): the device only shows
// them. What the processor does not draw is drawn by the passes, as on any device.
#include <algorithm>
#include <chrono>
#include <cstring>

#include "render/frame_setup.h"
#include "render/pixel_samples.h"
#include "render/view/renderer_view.h"

namespace vcp {

namespace {

void copyInto(const Buffer& buffer, std::span<const uint32_t> colours) {
    std::memcpy(buffer.mapped(), colours.data(), colours.size_bytes());
}

}  // namespace

bool Renderer::View::isCastOnHost() const {
    if (!shared->options.hostRays || !shared->info.software) return false;
    if (shared->meso && shared->preparedSurfaces().empty()) return false;
    return std::all_of(layers.begin(), layers.end(), [](const Layer& layer) {
        if (layer.residency == nullptr) return true;
        return checkHostDraws(layer.residency->dataset(), "").ok() && !poolOf(*layer.residency).bytesOf({0, 1}).empty();
    });
}

std::vector<HostDataset> Renderer::View::hostDatasets() const {
    std::vector<HostDataset> datasets;
    for (size_t i = 0; i < layers.size(); ++i)
        if (const Layer& layer = layers[i]; layer.residency != nullptr)
            datasets.push_back({*layer.residency, layer.placement, uint32_t(i), layer.errorPixels, number});
    return datasets;
}

Result<void> Renderer::View::cast(size_t which, const FrameRequest& request, const std::optional<PicturePixel>& cursor,
                                  const std::function<bool()>& cancel) {
    Frame& frame = frames[which];
    const auto began = std::chrono::steady_clock::now();
    const std::vector<HostDataset> datasets = hostDatasets();
    Buffer colours = frame.cast ? std::move(frame.cast->colours) : Buffer();
    frame.cast.reset();
    VCP_TRY_ASSIGN(auto picture, drawOnHost(datasets, shared->preparedSurfaces(), request, cancel));
    if (colours.bytes() != picture.colours.size() * sizeof(uint32_t)) {
        VCP_TRY_ASSIGN(
            colours, shared->device->createBuffer(picture.colours.size() * sizeof(uint32_t),
                                                  VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                                  MemoryUse::Upload));
    }
    copyInto(colours, picture.colours);
    frame.request = request;
    frame.cursor = cursor;
    frame.part.reset();
    frame.steps.clear();
    frame.nextStep = 0;
    frame.submission = 0;
    frame.isAhead = false;
    frame.stats = hostStats(datasets, shared->preparedSurfaces(), picture);
    SampledLight light(picture.colours.size());
    frame.cast = {std::move(picture), cutNumbers(datasets), std::move(light), std::move(colours)};
    frame.stats.msFrame = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count();
    lastDone = {++framesDone, request, frame.stats, cursor, std::nullopt};
    if (cursor) lastDone->hit = castHit(frame, *cursor);
    return {};
}

Result<uint32_t> Renderer::View::castPart() {
    Frame& shown = frames[*drawn];
    CastPicture& cast = *shown.cast;
    const std::vector<HostDataset> datasets = hostDatasets();
    if (cutNumbers(datasets) != cast.cuts || !isCastOnHost()) return 0u;
    FrameRequest request = shown.request;
    request.sample = samples;
    const PicturePart part = picturePart(request, nextPart, raysPerPixel(request, shared->meso != nullptr));
    VCP_TRY_ASSIGN(const auto drawnPart, drawOnHost(datasets, shared->preparedSurfaces(), part.request, {}));
    if (samples == 1 && nextPart == 0) cast.light.add(cast.picture.colours);
    const size_t width = request.width;
    cast.light.add(std::span(drawnPart.colours).subspan(part.skippedRows * width, part.rows * width), part.row * width);
    ++nextPart;
    if (!part.isLast) return samples;
    // What presents the picture so far may still read it.
    VCP_TRY(shared->device->waitFor(shown.lastUse));
    copyInto(cast.colours, cast.light.mean());
    nextPart = 0;
    return ++samples;
}

std::optional<PixelHit> Renderer::View::castHit(const Frame& frame, PicturePixel pixel) const {
    const HostPicture& picture = frame.cast->picture;
    const size_t at = size_t{pixel.y} * frame.request.width + pixel.x;
    if (picture.hits[at].dataset == HostHit().dataset) return {};
    PixelHit hit = pixelHit(frame.request, pixel, double(picture.depth[at]), picture.normals[at]);
    hit.onSurface = picture.hits[at].dataset == HostHit::kOnSurface;
    hit.dataset = hit.onSurface ? 0 : picture.hits[at].dataset;
    hit.onCap = picture.hits[at].onCap != 0;
    return hit;
}

}  // namespace vcp
