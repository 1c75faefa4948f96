// Renderer: brings what was drawn to the CPU, the host's images and the window.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>

#include "render/frame_setup.h"
#include "render/passes/readback.h"
#include "render/renderer_state.h"

namespace vcp {

namespace {

// Planes of the surfaces' hits (shared/meso_layout.h).
constexpr uint32_t kMesoDepth = 0, kMesoNormal = 1, kMesoIterations = 3;

}  // namespace

Result<std::vector<uint32_t>> Renderer::State::hitPlane(const Layer& layer, uint32_t plane, uint32_t missing) const {
    const auto& resources = layer.resources;
    if (!drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    const PictureSize size = resources->size();
    auto starts = readWords(*device, resources->tileStarts(), 0, uint64_t{size.tilesX()} * size.tilesY());
    if (!starts) return starts;
    auto words = readWords(*device, resources->hits(), plane * size.pixels(), size.pixels());
    if (!words) return words;
    for (uint32_t y = 0; y < size.height; ++y)
        for (uint32_t x = 0; x < size.width; ++x) {
            const uint32_t tile = y / frame::kTileSize * size.tilesX() + x / frame::kTileSize;
            if (std::bit_cast<float>((*starts)[tile]) >= frame::kTileEmpty)
                (*words)[uint64_t{y} * size.width + x] = missing;
        }
    return words;
}

Result<std::vector<uint32_t>> Renderer::State::mesoPlane(uint32_t plane) const {
    if (mesoTarget.size.width == 0) return std::vector<uint32_t>{};
    return readWords(*device, mesoTarget.hits, plane * mesoTarget.size.pixels(), mesoTarget.size.pixels());
}

Result<Picture> Renderer::readPicture() {
    const State& s = *state_;
    if (!s.drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    const FrameResources& resources = *s.layers.front().resources;
    const PictureSize size = resources.size();
    VCP_TRY_ASSIGN(auto words, readWords(*s.device, resources.picture(), 0, size.pixels()));
    Picture picture{size.width, size.height, std::vector<uint8_t>(size.pixels() * 4)};
    std::memcpy(picture.rgba.data(), words.data(), picture.rgba.size());
    return picture;
}

Result<std::vector<float>> Renderer::readDepth() {
    if (!state_->drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    auto depth = state_->depthOf(state_->layers.front());
    for (size_t i = 1; depth && i < state_->layers.size(); ++i) {
        const auto other = state_->depthOf(state_->layers[i]);
        if (!other) return other;
        std::transform(depth->begin(), depth->end(), other->begin(), depth->begin(),
                       [](float a, float b) { return b < a || std::isnan(a) ? b : a; });
    }
    const auto depths = state_->mesoPlane(kMesoDepth), normals = state_->mesoPlane(kMesoNormal);
    if (!depths || !normals) return depths ? normals.error() : depths.error();
    for (size_t i = 0; depth && i < normals->size(); ++i)
        if ((*normals)[i] != 0) (*depth)[i] = std::bit_cast<float>((*depths)[i]);
    return depth;
}

Result<std::vector<float>> Renderer::State::depthOf(const Layer& layer) const {
    VCP_TRY_ASSIGN(auto words, hitPlane(layer, 0, std::bit_cast<uint32_t>(frame::kNoHit)));
    const double cell = layer.unit();
    std::vector<float> depth(words.size());
    std::transform(words.begin(), words.end(), depth.begin(), [&](uint32_t word) {
        const float cells = std::abs(std::bit_cast<float>(word));
        if (cells >= frame::kGaveUp) return std::numeric_limits<float>::quiet_NaN();
        return cells >= frame::kNoHit ? std::numeric_limits<float>::infinity() : float(double(cells) * cell);
    });
    return depth;
}

Result<std::vector<uint32_t>> Renderer::readWork() {
    const State& s = *state_;
    if (!s.drawn || !showsWork(s.drawn->shading.mode))
        return Error{.code = ErrorCode::Usage, .message = "the last picture does not show work"};
    const ShadingMode mode = s.drawn->shading.mode;
    const float most = mode == ShadingMode::Steps   ? frame::kMostShownSteps
                       : mode == ShadingMode::Cells ? frame::kMostShownCells
                                                    : frame::kMostShownFetches;
    std::vector<uint32_t> work;
    for (const State::Layer& layer : s.layers) {
        const auto words = s.hitPlane(layer, hitPlanes(layer.drawn, layer.constants.colour) - 1, 0);
        if (!words) return words;
        work.resize(words->size());
        for (size_t i = 0; i < work.size(); ++i)
            work[i] += uint32_t(std::lround(std::bit_cast<float>((*words)[i]) * most));
    }
    return work;
}

Result<std::vector<glm::vec3>> Renderer::readNormals() {
    std::vector<float> nearest;
    std::vector<glm::vec3> normals;
    for (const State::Layer& layer : state_->layers) {
        VCP_TRY_ASSIGN(const auto depth, state_->depthOf(layer));
        VCP_TRY_ASSIGN(const auto words, state_->hitPlane(layer, 1, 0));
        nearest.resize(words.size(), std::numeric_limits<float>::infinity());
        normals.resize(words.size(), glm::vec3(0));
        const glm::quat turn(layer.placement.rotation);
        for (size_t i = 0; i < normals.size(); ++i) {
            if (!(depth[i] < nearest[i])) continue;
            nearest[i] = depth[i];
            normals[i] = turn * unpackNormal(words[i]);
        }
    }
    VCP_TRY_ASSIGN(const auto words, state_->mesoPlane(kMesoNormal));
    for (size_t i = 0; i < words.size(); ++i)
        if (words[i] != 0) normals[i] = unpackNormal(words[i]);
    return normals;
}

Result<std::vector<uint32_t>> Renderer::readIterations() {
    if (!state_->drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    auto words = state_->mesoPlane(kMesoIterations);
    if (words) words->resize(state_->layers.front().resources->size().pixels());
    return words;
}

Result<std::optional<PixelHit>> Renderer::pick(uint32_t x, uint32_t y) {
    const State& s = *state_;
    if (!s.drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    std::optional<PixelHit> nearest;
    for (size_t i = 0; i < s.layers.size(); ++i) {
        const auto hit = s.pick(s.layers[i], x, y);
        if (!hit) return hit;
        if (!*hit || (nearest && nearest->depth <= (*hit)->depth)) continue;
        nearest = **hit;
        nearest->dataset = i;
    }
    const auto onSurface = s.pickSurfaces(x, y);
    if (!onSurface) return onSurface;
    return *onSurface ? *onSurface : nearest;
}

Result<std::optional<PixelHit>> Renderer::State::pickSurfaces(uint32_t x, uint32_t y) const {
    const PictureSize size = mesoTarget.size;
    if (x >= size.width || y >= size.height) return std::optional<PixelHit>{};
    const uint64_t at = uint64_t{y} * size.width + x;
    const WordPlace places[] = {{&mesoTarget.hits, kMesoDepth * size.pixels() + at},
                                {&mesoTarget.hits, kMesoNormal * size.pixels() + at}};
    VCP_TRY_ASSIGN(const auto words, readEach(*device, places));
    const auto [depth, normal] = std::pair(words[0], words[1]);
    if (normal == 0) return std::optional<PixelHit>{};
    PixelHit hit = hitAt(x, y, double(std::bit_cast<float>(depth)));
    hit.normal = unpackNormal(normal);
    hit.onSurface = true;
    return std::optional<PixelHit>(hit);
}

PixelHit Renderer::State::hitAt(uint32_t x, uint32_t y, double depth) const {
    const PictureTile whole = wholePicture(*drawn);
    const CameraRay ray =
        cameraRay(drawn->camera, whole.fullWidth, whole.fullHeight, whole.x + x + 0.5, whole.y + y + 0.5);
    return {.depth = depth, .position = ray.origin + ray.direction * depth, .normal = glm::vec3(0)};
}

Result<std::optional<PixelHit>> Renderer::State::pick(const Layer& layer, uint32_t x, uint32_t y) const {
    const auto& resources = layer.resources;
    const PictureSize size = resources->size();
    if (x >= size.width || y >= size.height || layer.residency == nullptr) return std::optional<PixelHit>{};
    const uint64_t tile = uint64_t{y / frame::kTileSize} * size.tilesX() + x / frame::kTileSize;
    const uint64_t at = uint64_t{y} * size.width + x;
    const WordPlace places[] = {
        {&resources->tileStarts(), tile}, {&resources->hits(), at}, {&resources->hits(), size.pixels() + at}};
    VCP_TRY_ASSIGN(const auto read, readEach(*device, places));
    const std::vector<uint32_t>& words = read;
    const float cells = std::abs(std::bit_cast<float>(words[1]));
    const bool onCap = std::signbit(std::bit_cast<float>(words[1]));
    if (std::bit_cast<float>(words[0]) >= frame::kTileEmpty || cells >= frame::kNoHit) return std::optional<PixelHit>{};
    PixelHit hit = hitAt(x, y, double(cells) * layer.unit());
    hit.onCap = onCap;
    hit.normal = glm::quat(layer.placement.rotation) * unpackNormal(words[2]);
    return std::optional<PixelHit>(hit);
}

Result<void> Renderer::copyPicture(const ImageTarget& target) {
    State& s = *state_;
    if (!s.drawn) return Error{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};
    if (!s.options.host)
        return Error{.code = ErrorCode::Usage,
                     .message = "images are those of a device of the host, and there is none"};
    if (target.image == VK_NULL_HANDLE || target.width == 0 || target.height == 0)
        return Error{.code = ErrorCode::Usage, .message = "there is no image, or it has no area"};
    if (!s.device->hasGraphics())
        return Error{.code = ErrorCode::Usage,
                     .message = "pictures are scaled to images by queues with graphics, which this is not"};
    if (!s.scaling) s.scaling = std::make_unique<PictureScaling>(*s.device);
    VCP_TRY(s.scaling->prepare(s.layers.front().resources->size()));
    VCP_TRY_ASSIGN(auto commands, s.device->beginCommands());
    s.scaling->record(commands, s.layers.front().resources->picture(), target.image, {target.width, target.height});
    changeLayout(commands, target.image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, target.layoutAfter,
                 VK_ACCESS_TRANSFER_WRITE_BIT, VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT);
    return s.device->endCommandsAndWait(target.wait, target.signal);
}

std::vector<PageBox> Renderer::residentPages() const {
    std::vector<PageBox> boxes;
    for (const State::Layer& layer : state_->layers) {
        if (layer.residency == nullptr) continue;
        const Dataset& dataset = layer.residency->dataset();
        const std::vector<uint64_t>& cut = layer.residency->cut(state_->number);
        layer.residency->forEachResident([&](uint64_t page) {
            const PageEntry& entry = dataset.pages[page];
            const glm::dvec3 low = dataset.originOf(entry);
            const double edge = dataset.edgeOf(entry) * layer.placement.scale;
            PageBox box{
                layer.placement.toWorld(low), {}, entry.level, std::binary_search(cut.begin(), cut.end(), page)};
            for (int axis = 0; axis < 3; ++axis) {
                glm::dvec3 along(0);
                along[axis] = edge;
                box.edges[size_t(axis)] = layer.placement.rotation * along;
            }
            boxes.push_back(box);
        });
    }
    return boxes;
}

void Renderer::keepFeedback(bool keep) {
    state_->keepsFeedback = keep;
    state_->feedbackPicture.reset();
}

const std::optional<FeedbackPicture>& Renderer::feedbackPicture() const { return state_->feedbackPicture; }

Result<void> Renderer::present(uint32_t width, uint32_t height, const DrawOver& drawOver) {
    State& s = *state_;
    if (!s.swapchain) return Error{.code = ErrorCode::Usage, .message = "the renderer was made without a window"};
    if (!s.drawn) return {};
    const FrameResources& resources = *s.layers.front().resources;
    return s.swapchain->show(resources.picture(), resources.size(), {width, height}, drawOver);
}

Result<WindowDrawing> Renderer::windowDrawing() {
    const State& s = *state_;
    if (!s.swapchain) return Error{.code = ErrorCode::Usage, .message = "the renderer was made without a window"};
    VCP_TRY_ASSIGN(const auto renderPass, s.swapchain->renderPass());
    return WindowDrawing{s.instance->handle(), s.device->physical(),    s.device->handle(),
                         s.device->queue(),    s.device->queueFamily(), renderPass};
}

}  // namespace vcp
