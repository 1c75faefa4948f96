#include "render/host_renderer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>

#include "octree/surface/morton.h"
#include "render/frame_setup.h"
#include "render/pages/host_page_memory.h"
#include "render/pixel_samples.h"

namespace vcp {

namespace {

const Error kNothingDrawn{.code = ErrorCode::Usage, .message = "nothing was drawn yet"};

Error unsupported(const char* what) {
    return {.code = ErrorCode::Unsupported,
            .message = fmt::format("the host does not draw {}; take a Vulkan device", what)};
}

Result<void> checkDrawable(const PlacedDataset& placed) {
    const Dataset& dataset = *placed.dataset;
    const auto refused = [&](const char* message) {
        return Error{.code = ErrorCode::Unsupported, .message = message, .file = placed.source->name()};
    };
    if (dataset.header.method == Method::Paper)
        return refused("the host does not draw files built by the paper's method; take a Vulkan device");
    // Where pages do not cover the surface, the shaders continue coarser pages into finer ones.
    if (dataset.header.levels > 1 && !dataset.isCovering())
        return refused(
            "the host does not draw the seams between levels that are no slabs, as this file's; take a Vulkan device");
    return {};
}

/// Returns the rays of the part of a picture that a request draws.
PictureRays raysOf(const FrameRequest& request) {
    const PictureTile whole = wholePicture(request);
    PictureRays rays = pictureRays(request.camera, whole.fullWidth, whole.fullHeight);
    const glm::dvec2 corner = upperLeft(request);
    rays.origin = rays.originAt(corner.x, corner.y);
    rays.direction = rays.directionAt(corner.x, corner.y);
    rays.size = {int(request.width), int(request.height)};
    return rays;
}

/// The pages of a cut, as rays are cast through them; the views that the scene points to.
struct PlacedCut {
    std::vector<PageView> views;
    std::vector<HostPage> pages;
};

PlacedCut placedCut(Residency& residency) {
    const Dataset& dataset = residency.dataset();
    const auto& memory = static_cast<const HostPageMemory&>(residency.pages());
    const std::vector<uint64_t>& cut = residency.cut();
    PlacedCut placed;
    placed.views.reserve(cut.size());
    auto partial = residency.partial().begin();
    for (const uint64_t number : cut) {
        const PageEntry& entry = dataset.pages[number];
        const std::span<const std::byte> bytes = memory.bytesOf(residency.slotOf(number));
        const uint64_t colours = residency.hasColour() ? entry.colourBytes : 0;
        placed.views.push_back(viewOfChecked(bytes.first(entry.pageBytes), bytes.subspan(entry.pageBytes, colours)));
        HostPage page{.view = &placed.views.back(),
                      .number = number,
                      .place = mortonDecode(entry.morton),
                      .level = entry.level,
                      .error = float(double(entry.certifiedError) / dataset.header.cell)};
        if (partial == residency.partial().end() || partial->page != number) {
            placed.pages.push_back(page);
            continue;
        }
        for (uint32_t octants = partial++->octants; octants != 0; octants &= octants - 1) {
            page.octant = uint32_t(std::countr_zero(octants));
            placed.pages.push_back(page);
        }
    }
    return placed;
}

/// Returns the numbers, in the directory, of the pages that rays marked, and of those in whose place these are drawn.
std::vector<uint64_t> markedPages(const Dataset& dataset, const HostScene& scene, const PageMarks& marks) {
    std::vector<uint64_t> pages;
    for (uint32_t i = 0; i < scene.pages(); ++i) {
        if (!marks.isMarked(i)) continue;
        const HostScene::Page& page = scene.page(i);
        pages.push_back(page.number);
        if (page.octant) pages.push_back(childIn(dataset.pages[page.number], *page.octant));
    }
    return pages;
}

}  // namespace

DeviceInfo hostDevice() {
    return {.name = kHostName,
            .type = "cpu",
            .driver = "instructions " + hostInstructionSet(),
            .software = true,
            .usable = true};
}

Result<void> checkHostDraws(const FrameRequest& request) {
    const ShadingMode mode = request.shading.mode;
    if (!request.sections.empty()) return unsupported("section planes");
    if (mode == ShadingMode::Steps || mode == ShadingMode::Cells || mode == ShadingMode::Fetches || request.countSteps)
        return unsupported("the work of rays");
    return {};
}

Result<std::unique_ptr<HostRenderer>> HostRenderer::create(const RendererOptions& options) {
    VCP_TRY(checkBudget(options.budgetBytes));
    if (options.validation)
        return Error{.code = ErrorCode::Unsupported, .message = "validation layers are Vulkan's: the host has none"};
    return std::unique_ptr<HostRenderer>(new HostRenderer(options));
}

Result<void> HostRenderer::open(std::vector<PlacedDataset> datasets, std::span<const MesoSurface> surfaces) {
    datasets_.clear();
    VCP_TRY(setSurfaces(surfaces));
    for (const PlacedDataset& placed : datasets) VCP_TRY(checkDrawable(placed));
    VCP_TRY_ASSIGN(datasets_, openResidencies(hostPageMemory(), options_, std::move(datasets)));
    errorPixels_.assign(datasets_.size(), std::numeric_limits<double>::infinity());
    return {};
}

Result<void> HostRenderer::setSurfaces(std::span<const MesoSurface> surfaces) {
    return surfaces.empty() ? Result<void>() : unsupported("surfaces with mesostructure");
}

Result<UpdateResult> HostRenderer::update(const FrameRequest& request) {
    VCP_TRY(checkRequest(request));
    VCP_TRY(checkHostDraws(request));
    std::optional<UpdateResult> all;
    for (size_t i = 0; i < datasets_.size(); ++i) {
        if (isHidden(request, i)) continue;
        const auto& [residency, placement] = datasets_[i];
        VCP_TRY_ASSIGN(auto one, residency->update(selectionView(requestIn(placement, request))));
        errorPixels_[i] = one.errorPixels;
        if (all)
            add(*all, one);
        else
            all = std::move(one);
    }
    if (!all)
        return UpdateResult{
            .settled = true, .drawable = !datasets_.empty(), .errorPixels = std::numeric_limits<double>::infinity()};
    return *std::move(all);
}

Result<void> HostRenderer::drawDataset(size_t number, const FrameRequest& request, const HostCastOptions& options,
                                       HostPicture& picture) {
    const auto& [residency, placement] = datasets_[number];
    const FrameRequest seen = requestIn(placement, request);
    const Dataset& dataset = residency->dataset();
    const PlacedCut cut = placedCut(*residency);
    VCP_TRY_ASSIGN(const auto scene, HostScene::create(hostGrid(dataset.header), cut.pages));
    const bool hasColour = residency->hasColour();
    const bool reports = residency->asksRays() && request.sample == 0;
    PictureMarks marks(scene.pages());
    const HostLayer layer{.scene = scene,
                          .rays = raysOf(seen),
                          .frame = frameConstants(seen, &dataset, 1, hasColour, errorPixels_[number], placement),
                          .hasColour = hasColour,
                          .worldPerUnit = placement.scale,
                          .marks = reports ? &marks : nullptr};
    VCP_TRY(drawLayer(layer, options, picture));
    if (reports)
        residency->see({markedPages(dataset, scene, marks.byCamera), markedPages(dataset, scene, marks.byLight)},
                       selectionView(seen), residency->cutNumber());
    return {};
}

Result<FrameStats> HostRenderer::render(const FrameRequest& request, const std::function<bool()>& cancel) {
    drawn_.reset();
    VCP_TRY(checkRequest(request));
    VCP_TRY(checkHostDraws(request));
    const auto began = std::chrono::steady_clock::now();
    VCP_TRY_ASSIGN(auto picture, draw(request, cancel));
    FrameStats stats{.rays = picture.depth.size(), .tracedRays = picture.depth.size()};
    for (const auto& [residency, placement] : datasets_) {
        stats.poolBytes += residency->pages().bytes();
        stats.colourBytes += residency->colourBytes();
        stats.pagesInCut += uint32_t(residency->cut().size());
    }
    stats.hitPixels = uint64_t(std::ranges::count_if(picture.depth, [](float depth) { return std::isfinite(depth); }));
    stats.msFrame = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count();
    drawn_ = std::move(picture);
    request_ = request;
    cuts_ = cutNumbers();
    light_ = {};
    return stats;
}

Result<HostPicture> HostRenderer::draw(const FrameRequest& request, const std::function<bool()>& cancel) {
    const HostCastOptions options{.cancel = cancel};
    HostPicture picture({int(request.width), int(request.height)}, backgroundRows(request));
    for (size_t i = 0; i < datasets_.size(); ++i)
        if (!isHidden(request, i)) VCP_TRY(drawDataset(i, request, options, picture));
    return picture;
}

std::vector<uint64_t> HostRenderer::cutNumbers() const {
    std::vector<uint64_t> all;
    for (const auto& [residency, placement] : datasets_) all.push_back(residency->cutNumber());
    return all;
}

Result<uint32_t> HostRenderer::refine(const std::function<bool()>& cancel) {
    if (!drawn_) return 0u;
    const uint32_t samples = std::max(light_.samples(), 1u);
    VCP_TRY(checkRefinable(request_, samples));
    if (cutNumbers() != cuts_) return 0u;
    FrameRequest request = request_;
    request.sample = samples;
    VCP_TRY_ASSIGN(const auto more, draw(request, cancel));
    if (samples == 1) light_.add(drawn_->colours);
    light_.add(more.colours);
    return light_.samples();
}

Result<Picture> HostRenderer::readPicture() {
    if (!drawn_) return kNothingDrawn;
    const std::vector<uint32_t> colours = light_.samples() > 0 ? light_.mean() : drawn_->colours;
    Picture picture{uint32_t(drawn_->size.x), uint32_t(drawn_->size.y), std::vector<uint8_t>(colours.size() * 4)};
    std::memcpy(picture.rgba.data(), colours.data(), picture.rgba.size());
    return picture;
}

Result<std::vector<float>> HostRenderer::readDepth() {
    if (!drawn_) return kNothingDrawn;
    return drawn_->depth;
}

Result<std::vector<glm::vec3>> HostRenderer::readNormals() {
    if (!drawn_) return kNothingDrawn;
    return drawn_->normals;
}

Result<std::vector<uint32_t>> HostRenderer::readIterations() {
    if (!drawn_) return kNothingDrawn;
    return std::vector<uint32_t>(drawn_->depth.size(), 0);
}

}  // namespace vcp
