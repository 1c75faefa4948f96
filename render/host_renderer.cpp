#include "render/host_renderer.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "render/frame_setup.h"
#include "render/pages/host_page_memory.h"
#include "render/pixel_samples.h"

namespace vcp {

namespace {

const Error kNothingDrawn{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};

}  // namespace

DeviceInfo hostDevice() {
    return {.name = kHostName,
            .type = "cpu",
            .driver = "instructions " + hostInstructionSet(),
            .software = true,
            .usable = true};
}

Result<std::unique_ptr<HostRenderer>> HostRenderer::create(const RendererOptions& options) {
    VCP_TRY(checkBudget(options.budgetBytes));
    if (options.validation)
        return Error{.code = ErrorCode::Unsupported, .message = "validation layers are Vulkan's: the host has none"};
    return std::unique_ptr<HostRenderer>(new HostRenderer(options));
}

Result<void> HostRenderer::open(std::vector<PlacedDataset> datasets, std::span<const MesoSurface> surfaces) {
    datasets_.clear();
    VCP_TRY(takeSurfaces(surfaces));
    const auto openAll = [&]() -> Result<void> {
        for (const PlacedDataset& placed : datasets) VCP_TRY(checkHostDraws(*placed.dataset, placed.source->name()));
        RendererOptions left = options_;
        VCP_TRY_ASSIGN(auto images, findImages(datasets, options_.colour, options_.ramBytes / 2));
        VCP_TRY_ASSIGN(left.budgetBytes, budgetOfPages(options_.budgetBytes, bytesOf(prepared_)));
        VCP_TRY_ASSIGN(datasets_, openResidencies(hostPageMemory(), left, std::move(datasets), std::move(images)));
        return {};
    };
    if (auto opened = openAll(); !opened) {
        VCP_TRY(takeSurfaces({}));
        return opened;
    }
    errorPixels_.assign(datasets_.size(), std::numeric_limits<double>::infinity());
    return {};
}

Result<void> HostRenderer::takeSurfaces(std::span<const MesoSurface> surfaces) {
    picture_.reset();
    surfacesChanged_ = surfacesChanged_ || !surfaces_.empty() || !surfaces.empty();
    prepared_.clear();
    surfaces_.assign(surfaces.begin(), surfaces.end());
    auto prepared = prepareOnHost(surfaces_);
    if (!prepared) {
        surfaces_.clear();
        return prepared.error();
    }
    prepared_ = *std::move(prepared);
    return {};
}

Result<void> HostRenderer::setSurfaces(std::span<const MesoSurface> surfaces) {
    const uint64_t before = bytesOf(prepared_);
    VCP_TRY(takeSurfaces(surfaces));
    if (datasets_.empty() || bytesOf(prepared_) == before) return {};
    const auto fit = [&]() -> Result<void> {
        VCP_TRY_ASSIGN(const auto pageBytes, budgetOfPages(options_.budgetBytes, bytesOf(prepared_)));
        return sceneOf(datasets_)->setBudgets(hostPageMemory(), pageBytes,
                                              ramOfPages(options_.ramBytes, imageBytes(datasets_)));
    };
    auto fits = fit();
    if (!fits) VCP_TRY(takeSurfaces({}));
    return fits;
}

Result<UpdateResult> HostRenderer::update(const FrameRequest& request) {
    VCP_TRY(checkRequest(request));
    std::vector<ShownResidency> shown;
    for (size_t i = 0; i < datasets_.size(); ++i)
        if (!isHidden(request, i))
            shown.push_back({datasets_[i].residency.get(), datasets_[i].placement, &errorPixels_[i]});
    VCP_TRY_ASSIGN(auto all, updateShown(shown, request));
    if (!all)
        all = UpdateResult{
            .settled = true, .drawable = !datasets_.empty(), .errorPixels = std::numeric_limits<double>::infinity()};
    all->changed = std::exchange(surfacesChanged_, false) || all->changed;
    all->drawable = all->drawable || !surfaces_.empty();
    return *std::move(all);
}

Result<FrameStats> HostRenderer::render(const FrameRequest& request, const std::function<bool()>& cancel) {
    picture_.reset();
    VCP_TRY(checkRequest(request));
    const auto began = std::chrono::steady_clock::now();
    const std::vector<HostDataset> drawing = drawn(request);
    VCP_TRY_ASSIGN(auto picture, drawOnHost(drawing, prepared_, request, cancel));
    FrameStats stats = hostStats(drawing, prepared_, picture);
    stats.msFrame = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count();
    light_ = SampledLight(picture.colours.size());
    picture_ = std::move(picture);
    request_ = request;
    cuts_ = cutNumbers(drawing);
    return stats;
}

std::vector<HostDataset> HostRenderer::drawn(const FrameRequest& request) const {
    std::vector<HostDataset> drawn;
    for (size_t i = 0; i < datasets_.size(); ++i)
        if (!isHidden(request, i))
            drawn.push_back({.residency = *datasets_[i].residency,
                             .placement = datasets_[i].placement,
                             .number = uint32_t(i),
                             .errorPixels = errorPixels_[i]});
    return drawn;
}

Result<uint32_t> HostRenderer::refine(const std::function<bool()>& cancel) {
    if (!picture_) return 0u;
    const uint32_t samples = std::max(light_.samples(), 1u);
    VCP_TRY(checkRefinable(request_, samples));
    const std::vector<HostDataset> drawing = drawn(request_);
    if (cutNumbers(drawing) != cuts_) return 0u;
    FrameRequest request = request_;
    request.sample = samples;
    VCP_TRY_ASSIGN(const auto more, drawOnHost(drawing, prepared_, request, cancel));
    if (samples == 1) light_.add(picture_->colours);
    light_.add(more.colours);
    return light_.samples();
}

Result<Picture> HostRenderer::readPicture() {
    if (!picture_) return kNothingDrawn;
    const std::vector<uint32_t> colours = light_.samples() > 0 ? light_.mean() : picture_->colours;
    Picture picture{uint32_t(picture_->size.x), uint32_t(picture_->size.y), std::vector<uint8_t>(colours.size() * 4)};
    std::memcpy(picture.rgba.data(), colours.data(), picture.rgba.size());
    return picture;
}

Result<std::vector<float>> HostRenderer::readDepth() {
    if (!picture_) return kNothingDrawn;
    return picture_->depth;
}

Result<std::vector<glm::vec3>> HostRenderer::readNormals() {
    if (!picture_) return kNothingDrawn;
    return picture_->normals;
}

Result<std::vector<uint32_t>> HostRenderer::readWork() {
    if (!picture_) return kNothingDrawn;
    if (picture_->work.empty()) return kNoWorkShown;
    return picture_->work;
}

Result<std::vector<uint32_t>> HostRenderer::readIterations() {
    if (!picture_) return kNothingDrawn;
    std::vector<uint32_t> iterations = picture_->iterations;
    iterations.resize(picture_->depth.size());
    return iterations;
}

}  // namespace vcp
