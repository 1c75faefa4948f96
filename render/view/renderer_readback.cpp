// Renderer: brings what was drawn to the CPU, the host's images and the window.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>

#include "render/false_colours.h"
#include "render/frame_setup.h"
#include "render/passes/readback.h"
#include "render/view/renderer_view.h"

namespace vcp {

using frame::kMesoPlaneDepth, frame::kMesoPlaneNormal;

Result<const Renderer::View::Frame*> Renderer::View::lastFrame() {
    if (!drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    const Frame* const frame = &frames[*drawn];
    VCP_TRY(takeInAll());
    return frame;
}

Result<std::vector<uint32_t>> Renderer::View::hitPlane(const LayerFrame& layer, uint32_t plane,
                                                       uint32_t missing) const {
    const FrameResources& resources = *layer.resources;
    const PictureSize size = resources.size();
    auto starts = readWords(*shared->device, resources.tileStarts(), 0, uint64_t{size.tilesX()} * size.tilesY());
    if (!starts) return starts;
    auto words = readWords(*shared->device, resources.hits(), plane * size.pixels(), size.pixels());
    if (!words) return words;
    for (uint32_t y = 0; y < size.height; ++y)
        for (uint32_t x = 0; x < size.width; ++x) {
            const uint32_t tile = y / frame::kTileSize * size.tilesX() + x / frame::kTileSize;
            if (std::bit_cast<float>((*starts)[tile]) >= frame::kTileEmpty)
                (*words)[uint64_t{y} * size.width + x] = missing;
        }
    return words;
}

Result<std::vector<uint32_t>> Renderer::View::mesoPlane(const Frame& frame, uint32_t plane) const {
    const PictureSize size = frame.surfaces.size;
    if (size.width == 0) return std::vector<uint32_t>{};
    return readWords(*shared->device, frame.surfaces.hits, plane * size.pixels(), size.pixels());
}

void Renderer::paintOver(PaintOver paint) { view_->paintOver = std::move(paint); }

Result<Picture> Renderer::readPicture() { return view_->hostPicture(); }

Result<Picture> Renderer::View::hostPicture() {
    VCP_TRY_ASSIGN(const auto frame, lastFrame());
    const PictureSize size = frame->size();
    VCP_TRY_ASSIGN(auto words, readWords(*shared->device, frame->picture(), 0, size.pixels()));
    Picture picture{size.width, size.height, std::vector<uint8_t>(size.pixels() * 4)};
    std::memcpy(picture.rgba.data(), words.data(), picture.rgba.size());
    if (paintOver) paintOver(frame->request, picture);
    return picture;
}

Result<const Buffer*> Renderer::View::shownPicture() {
    if (!paintOver || !drawn) return &frames[drawn ? *drawn : *begun].picture();
    VCP_TRY_ASSIGN(const auto picture, hostPicture());
    // Submissions that read the picture of before have ended: present() and copyPicture() wait for their own.
    if (painted.bytes() != picture.rgba.size()) {
        VCP_TRY_ASSIGN(painted, shared->device->createBuffer(picture.rgba.size(), VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                                             MemoryUse::Upload));
    }
    std::memcpy(painted.mapped(), picture.rgba.data(), picture.rgba.size());
    return &painted;
}

Result<std::vector<float>> Renderer::readDepth() {
    VCP_TRY_ASSIGN(const auto frame, view_->lastFrame());
    if (frame->cast) return frame->cast->picture.depth;
    auto depth = view_->depthOf(*frame, 0);
    for (size_t i = 1; depth && i < view_->layers.size(); ++i) {
        const auto other = view_->depthOf(*frame, i);
        if (!other) return other;
        std::transform(depth->begin(), depth->end(), other->begin(), depth->begin(),
                       [](float a, float b) { return b < a || std::isnan(a) ? b : a; });
    }
    const auto depths = view_->mesoPlane(*frame, kMesoPlaneDepth), normals = view_->mesoPlane(*frame, kMesoPlaneNormal);
    if (!depths || !normals) return depths ? normals.error() : depths.error();
    for (size_t i = 0; depth && i < normals->size(); ++i)
        if ((*normals)[i] != 0) (*depth)[i] = std::bit_cast<float>((*depths)[i]);
    return depth;
}

Result<std::vector<float>> Renderer::View::depthOf(const Frame& frame, size_t layer) const {
    VCP_TRY_ASSIGN(auto words, hitPlane(frame.layers[layer], 0, std::bit_cast<uint32_t>(frame::kNoHit)));
    const double cell = layers[layer].unit();
    std::vector<float> depth(words.size());
    std::transform(words.begin(), words.end(), depth.begin(), [&](uint32_t word) {
        const float cells = std::abs(std::bit_cast<float>(word));
        if (cells >= frame::kGaveUp) return std::numeric_limits<float>::quiet_NaN();
        return cells >= frame::kNoHit ? std::numeric_limits<float>::infinity() : float(double(cells) * cell);
    });
    return depth;
}

Result<std::vector<uint32_t>> Renderer::readWork() {
    const auto frame = view_->lastFrame();
    if (!frame || !showsWork((*frame)->request.shading.mode)) return kNoWorkShown;
    if ((*frame)->cast) return (*frame)->cast->picture.work;
    const ShadingMode mode = (*frame)->request.shading.mode;
    const auto most = float(falseColourEnd(mode));
    std::vector<uint32_t> work;
    for (const View::LayerFrame& layer : (*frame)->layers) {
        const auto words = view_->hitPlane(layer, hitPlanes(layer.request, layer.constants.colour) - 1, 0);
        if (!words) return words;
        work.resize(words->size());
        for (size_t i = 0; i < work.size(); ++i)
            work[i] += uint32_t(std::lround(std::bit_cast<float>((*words)[i]) * most));
    }
    return work;
}

Result<std::vector<glm::vec3>> Renderer::readNormals() {
    VCP_TRY_ASSIGN(const auto frame, view_->lastFrame());
    if (frame->cast) return frame->cast->picture.normals;
    std::vector<float> nearest;
    std::vector<glm::vec3> normals;
    for (size_t layer = 0; layer < view_->layers.size(); ++layer) {
        VCP_TRY_ASSIGN(const auto depth, view_->depthOf(*frame, layer));
        VCP_TRY_ASSIGN(const auto words, view_->hitPlane(frame->layers[layer], 1, 0));
        nearest.resize(words.size(), std::numeric_limits<float>::infinity());
        normals.resize(words.size(), glm::vec3(0));
        const glm::quat turn(view_->layers[layer].placement.rotation);
        for (size_t i = 0; i < normals.size(); ++i) {
            if (!(depth[i] < nearest[i])) continue;
            nearest[i] = depth[i];
            normals[i] = turn * unpackNormal(words[i]);
        }
    }
    VCP_TRY_ASSIGN(const auto words, view_->mesoPlane(*frame, kMesoPlaneNormal));
    for (size_t i = 0; i < words.size(); ++i)
        if (words[i] != 0) normals[i] = unpackNormal(words[i]);
    return normals;
}

Result<std::vector<uint32_t>> Renderer::readIterations() {
    VCP_TRY_ASSIGN(const auto frame, view_->lastFrame());
    auto words = frame->cast ? frame->cast->picture.iterations : view_->mesoPlane(*frame, frame::kMesoPlaneIterations);
    if (words) words->resize(frame->size().pixels());
    return words;
}

Result<std::optional<PixelHit>> Renderer::pick(uint32_t x, uint32_t y) { return view_->pick({x, y}); }

Result<std::optional<PixelHit>> Renderer::pickAt(glm::dvec2 pixel, glm::dvec2 size) {
    const auto pixelOf = [&](const FrameRequest& request) {
        const glm::dvec2 at = pixel * glm::dvec2(request.width, request.height) / size;
        return PicturePixel{uint32_t(at.x), uint32_t(at.y)};
    };
    if (!(pixel.x >= 0 && pixel.y >= 0 && pixel.x < size.x && pixel.y < size.y)) return std::optional<PixelHit>{};
    const std::optional<DoneFrame>& done = view_->lastDone;
    if (done && done->cursor && *done->cursor == pixelOf(done->request)) return done->hit;
    VCP_TRY_ASSIGN(const auto frame, view_->lastFrame());
    return view_->pick(pixelOf(frame->request));
}

Result<std::optional<PixelHit>> Renderer::View::pick(PicturePixel pixel) {
    VCP_TRY_ASSIGN(const auto last, lastFrame());
    const Frame& frame = *last;
    const PictureSize size = frame.size();
    if (pixel.x >= size.width || pixel.y >= size.height) return std::optional<PixelHit>{};
    if (frame.cast) return castHit(frame, pixel);
    const uint64_t tile = uint64_t{pixel.y / frame::kTileSize} * size.tilesX() + pixel.x / frame::kTileSize;
    const uint64_t at = uint64_t{pixel.y} * size.width + pixel.x;
    std::vector<WordPlace> places;
    for (const LayerFrame& layer : frame.layers) {
        const FrameResources& resources = *layer.resources;
        places.push_back({&resources.tileStarts(), tile});
        places.push_back({&resources.hits(), at});
        places.push_back({&resources.hits(), size.pixels() + at});
    }
    const bool hasSurfaces = frame.surfaces.size.width > 0;
    if (hasSurfaces) {
        places.push_back({&frame.surfaces.hits, kMesoPlaneDepth * size.pixels() + at});
        places.push_back({&frame.surfaces.hits, kMesoPlaneNormal * size.pixels() + at});
    }
    VCP_TRY_ASSIGN(const auto read, readEach(*shared->device, places));
    std::vector<HitWords> words;
    for (size_t i = 0; i < frame.layers.size(); ++i) words.push_back({read[3 * i], read[3 * i + 1], read[3 * i + 2]});
    MesoReport surfaces;
    if (hasSurfaces) surfaces.cursorDepth = read[read.size() - 2], surfaces.cursorNormal = read.back();
    return nearestHit(frame.request, pixel, words, surfaces);
}

std::optional<PixelHit> Renderer::View::nearestHit(const FrameRequest& request, PicturePixel pixel,
                                                   std::span<const HitWords> words, const MesoReport& surfaces) const {
    if (surfaces.cursorNormal != 0) {
        PixelHit hit = pixelHit(request, pixel, double(std::bit_cast<float>(surfaces.cursorDepth)),
                                unpackNormal(surfaces.cursorNormal));
        hit.onSurface = true;
        return hit;
    }
    std::optional<PixelHit> nearest;
    for (size_t i = 0; i < words.size(); ++i) {
        const float cells = std::abs(std::bit_cast<float>(words[i].depth));
        const bool isEmpty = std::bit_cast<float>(words[i].tileStart) >= frame::kTileEmpty;
        if (layers[i].residency == nullptr || isEmpty || cells >= frame::kNoHit) continue;
        const double depth = double(cells) * layers[i].unit();
        if (nearest && nearest->depth <= depth) continue;
        const glm::vec3 normal = glm::quat(layers[i].placement.rotation) * unpackNormal(words[i].normal);
        nearest = pixelHit(request, pixel, depth, normal);
        nearest->dataset = i;
        nearest->onCap = std::signbit(std::bit_cast<float>(words[i].depth));
    }
    return nearest;
}

Result<void> Renderer::copyPicture(const ImageTarget& target) {
    View& v = *view_;
    Device* const device = v.shared->device.get();
    VCP_TRY_ASSIGN(const auto frame, v.lastFrame());
    if (!v.shared->options.host)
        return Error{.code = ErrorCode::Usage,
                     .message = "images are those of a device of the host, and there is none"};
    if (target.image == VK_NULL_HANDLE || target.width == 0 || target.height == 0)
        return Error{.code = ErrorCode::Usage, .message = "there is no image, or it has no area"};
    if (!device->hasGraphics())
        return Error{.code = ErrorCode::Usage,
                     .message = "pictures are scaled to images by queues with graphics, which this is not"};
    if (!v.scaling) v.scaling = std::make_unique<PictureScaling>(*device);
    VCP_TRY(v.scaling->prepare(frame->size()));
    VCP_TRY_ASSIGN(const auto picture, v.shownPicture());
    VCP_TRY_ASSIGN(auto commands, device->beginCommands());
    v.scaling->record(commands, *picture, target.image, {target.width, target.height});
    changeLayout(commands, target.image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, target.layoutAfter,
                 VK_ACCESS_TRANSFER_WRITE_BIT, VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT);
    return device->endCommandsAndWait(target.wait, target.signal);
}

std::vector<PageBox> Renderer::residentPages() const {
    std::vector<PageBox> boxes;
    for (const View::Layer& layer : view_->layers) {
        if (layer.residency == nullptr) continue;
        const Dataset& dataset = layer.residency->dataset();
        const std::vector<uint64_t>& cut = layer.residency->cut(view_->number);
        for (const uint64_t page : layer.residency->residentPages()) {
            const PageEntry& entry = dataset.pages[page];
            const glm::dvec3 low = dataset.originOf(entry);
            const double edge = dataset.edgeOf(entry) * layer.placement.scale;
            PageBox box{
                layer.placement.toWorld(low), {}, entry.level, std::binary_search(cut.begin(), cut.end(), page)};
            box.number = page;
            for (int axis = 0; axis < 3; ++axis) {
                glm::dvec3 along(0);
                along[axis] = edge;
                box.edges[size_t(axis)] = layer.placement.rotation * along;
            }
            boxes.push_back(box);
        }
    }
    return boxes;
}

void Renderer::keepFeedback(bool keep) {
    view_->keepsFeedback = keep;
    view_->feedbackPicture.reset();
}

const std::optional<FeedbackPicture>& Renderer::feedbackPicture() const { return view_->feedbackPicture; }

Result<void> Renderer::present(uint32_t width, uint32_t height, const DrawOver& drawOver) {
    View& v = *view_;
    if (!v.swapchain) return Error{.code = ErrorCode::Usage, .message = "the renderer was made without a window"};
    // The first picture shows its background until it is finished.
    const std::optional<size_t> shown = v.drawn ? v.drawn : v.begun;
    if (!shown) return {};
    View::Frame& frame = v.frames[*shown];
    const DeviceWork before = v.shared->device->work();
    VCP_TRY_ASSIGN(const auto picture, v.shownPicture());
    const auto submission = v.swapchain->show(*picture, frame.size(), {width, height}, drawOver);
    frame.stats.submissions += v.shared->device->work().submissions - before.submissions;
    frame.stats.hostWaits += v.shared->device->work().waits - before.waits;
    // A device that was lost with frames in flight is found by the next update, which makes it anew.
    if (!submission && frame.isAhead && v.shared->device->isLost()) return {};
    if (!submission) return submission.error();
    frame.lastUse = std::max(frame.lastUse, *submission);
    return frame.isAhead && !v.paintOver ? Result<void>() : v.shared->device->waitFor(*submission);
}

Result<WindowDrawing> Renderer::windowDrawing() {
    const View& v = *view_;
    if (!v.swapchain) return Error{.code = ErrorCode::Usage, .message = "the renderer was made without a window"};
    VCP_TRY_ASSIGN(const auto renderPass, v.swapchain->renderPass());
    const Device& device = *v.shared->device;
    return WindowDrawing{v.shared->instance->handle(), device.physical(), device.handle(), device.queue(),
                         device.queueFamily(),         renderPass};
}

}  // namespace vcp
