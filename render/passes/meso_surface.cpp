#include "render/passes/meso_surface.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <tuple>
#include <utility>

#include "mesostructure/remesh/remesh_frames.h"
#include "render/frame_setup.h"
#include "render/meso_look.h"
#include "render/meso_shade_spirv.h"
#include "render/meso_surface_spirv.h"
#include "render/remesh_merge_spirv.h"

namespace vcp {

namespace {

constexpr VkBufferUsageFlags kConstantsUse = VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;

PictureSize sizeOf(const FrameRequest& request) { return {request.width, request.height}; }

constexpr uint32_t kConstantOfAllTiles = 10;  // kAllTiles of shaders/remesh_merge.comp
// What a pipeline casts (kRays of shaders/meso_surface.comp).
constexpr uint32_t kPictureRays = 0, kRaysToLights = 1, kRayToLight = 2, kRayIntoSky = 3;

VkBuffer handleOf(const Buffer* buffer) { return buffer != nullptr ? buffer->handle() : VK_NULL_HANDLE; }

/// Returns what all tiles of the surfaces' heights take.
uint64_t bytesOfHeights(std::span<const MesoSurface> surfaces) {
    std::map<const meso::HeightLevels*, uint64_t> bytes;
    for (const MesoSurface& surface : surfaces)
        if (surface.remeshed.surface) {
            const meso::HeightLevels& heights = *surface.remeshed.surface->heights;
            bytes[&heights] = HeightPool::bytesOfAll(heights);
        }
    uint64_t sum = 0;
    for (const auto& [heights, count] : bytes) sum += count;
    return sum;
}

RemeshLook remeshLook(const FrameRequest& request) {
    return {request.camera, wholePicture(request), upperLeft(request), sizeOf(request)};
}

}  // namespace

Result<HeightPool*> MesoSurfacePass::heightsFor(const RemeshedSurface& surface, uint64_t mostBytes) {
    for (const auto& known : heights_)
        if (&known->heights() == surface.surface->heights.get()) return known.get();
    VCP_TRY_ASSIGN(auto made, HeightPool::create(device_, surface.surface->heights, mostBytes));
    return heights_.emplace_back(std::move(made)).get();
}

Result<void> MesoSurfacePass::setSurfaces(std::span<const MesoSurface> surfaces, uint64_t heightBytes) {
    surfaces_.clear(), heights_.clear();
    remeshed_ = 0;
    ++version_;
    std::map<const meso::MarchArrays*, std::shared_ptr<MesoTexels>> uploaded;
    const double share = double(heightBytes) / double(std::max<uint64_t>(bytesOfHeights(surfaces), 1));
    std::map<LookKey, std::shared_ptr<MesoTexels>> looks;
    std::vector<Placed> placed;
    for (const MesoSurface& surface : surfaces) {
        Placed made;
        made.remeshed = surface.remeshed;
        made.origin = surface.arrays ? surface.shell.origin : made.remeshed.surface->origin;
        if (made.remeshed.surface) {
            made.number = remeshed_++;
            const uint64_t all = HeightPool::bytesOfAll(*made.remeshed.surface->heights);
            VCP_TRY_ASSIGN(made.heights, heightsFor(made.remeshed, share < 1 ? uint64_t(share * double(all)) : all));
            // A pixel has the number in single precision.
            if (made.remeshed.surface->triangles.size() >= (size_t{1} << 24))
                return Error{.code = ErrorCode::Limit, .message = "a remeshed base has less than 2^24 triangles"};
            VCP_TRY_ASSIGN(made.frames, resources_.vectors(meso::remeshFrames(*made.remeshed.surface, made.origin)));
        }
        made.arrays = surface.arrays;
        if (surface.arrays) {
            auto& words = uploaded[surface.arrays.get()];
            if (!words) {
                VCP_TRY_ASSIGN(auto texels, resources_.words(surface.arrays->words));
                words = std::make_shared<MesoTexels>(std::move(texels));
            }
            made.words = words;
        }
        const MesoLook described = mesoLook(surface);
        made.view = described.view, made.textures = described.textures, made.isFarDrawn = described.isFarDrawn;
        made.hasTransfer = surface.transfer != nullptr;
        if (changesBaseLight(surface)) made.baseTransfer = surface.baseTransfer;
        auto& look = looks[lookKey(surface)];
        if (!look && !described.looks.empty()) {
            VCP_TRY_ASSIGN(auto uploadedLook, resources_.halfs(described.looks));
            look = std::make_shared<MesoTexels>(std::move(uploadedLook));
        }
        made.look = look;
        if (made.arrays) {
            VCP_TRY_ASSIGN(auto shell, resources_.vectors(surface.shell.texels));
            made.shell = std::move(shell);
        }
        placed.push_back(std::move(made));
    }
    surfaces_ = std::move(placed);
    return {};
}

uint64_t MesoSurfacePass::assetBytes() const {
    std::map<const MesoTexels*, uint64_t> bytes;
    uint64_t sum = 0;
    for (const Placed& surface : surfaces_) {
        if (surface.remeshed.surface) sum += surface.frames.buffer.bytes();
        if (surface.arrays)
            bytes[surface.words.get()] = surface.words->buffer.bytes(), sum += surface.shell.buffer.bytes();
        if (surface.look) bytes[surface.look.get()] = surface.look->buffer.bytes();
    }
    for (const auto& [texels, count] : bytes) sum += count;
    for (const auto& heights : heights_) sum += heights->bytes();
    return sum;
}

Result<void> MesoSurfacePass::makeTarget(MesoTarget& target, PictureSize size, uint32_t planes, bool keepsTransfer,
                                         const Picture& picture) {
    // The target has no size until all of it is made.
    target = {};
    for (const auto& [buffer, bytes] : {std::pair(&target.hits, size.pixels() * planes * 4),
                                        std::pair(&target.counters, uint64_t{sizeof(MesoCounts)})}) {
        VCP_TRY_ASSIGN(*buffer, resources_.storage(bytes));
    }
    VCP_TRY_ASSIGN(target.reported,
                   device_.createBuffer(sizeof(MesoReport), VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Readback));
    if (remeshed_ > 0) VCP_TRY(raster_.prepare(target.remeshed, size, remeshed_));
    for (const auto& heights : heights_) {
        VCP_TRY_ASSIGN(
            target.marks.emplace_back().words,
            device_.createBuffer(heights->marks().bytes(), VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Readback));
    }
    for (const Placed& surface : surfaces_) {
        const bool isRemeshed = surface.remeshed.surface != nullptr;
        MesoTarget::Drawing drawing;
        VCP_TRY_ASSIGN(drawing.constants, device_.createBuffer(sizeof(MesoConstants), kConstantsUse, MemoryUse::Local));
        MesoTarget::Drawing::BaseLight& light = drawing.baseLight;
        const bool hasLight = surface.baseTransfer && keepsTransfer;
        if (hasLight) {
            VCP_TRY_ASSIGN(light.texels,
                           resources_.emptyHalfs(meso::BaseTransfer::kTexels * surface.baseTransfer->vertices()));
            VCP_TRY_ASSIGN(light.filled, device_.createBuffer(light.texels.buffer.bytes(),
                                                              VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryUse::Upload));
        }
        VCP_TRY_ASSIGN(drawing.set, resources_.makeSet({&drawing.constants, isRemeshed ? nullptr : surface.words.get(),
                                                        isRemeshed ? &target.remeshed.hits : &surface.shell,
                                                        &target.hits, picture.colours, &target.counters,
                                                        surface.look.get(), picture.sceneLight, picture.depths,
                                                        isRemeshed ? &surface.frames
                                                        : hasLight ? &light.texels
                                                                   : nullptr,
                                                        surface.heights}));
        if (isRemeshed && surface.arrays) {
            VCP_TRY_ASSIGN(drawing.lightSet,
                           resources_.makeSet({&drawing.constants, surface.words.get(), &surface.shell, &target.hits,
                                               picture.colours, &target.counters, nullptr, picture.sceneLight,
                                               picture.depths, nullptr}));
        }
        target.drawings.push_back(std::move(drawing));
    }
    target.size = size, target.planes = planes, target.keepsTransfer = keepsTransfer, target.surfaces = version_,
    target.picture = picture.colours->handle();
    target.sceneLight = handleOf(picture.sceneLight), target.depths = picture.depths->handle();
    return {};
}

Result<void> MesoSurfacePass::choosePipelines(const Placed& surface, MesoTarget::Drawing& drawing,
                                              const Shading& shading, bool inScene) {
    const std::vector<uint32_t> march =
        surface.arrays ? wordsOf(surface.arrays->constants) : wordsOf(meso::MarchConstants());
    const auto constantsFor = [&](uint32_t rays, uint32_t textures) {
        std::vector<uint32_t> constants = march;
        constants.insert(constants.end(), {rays, textures, surface.isFarDrawn ? 1u : 0u, inScene ? 1u : 0u});
        // Without the plane the pipelines are those of pictures without transfer.
        const bool withTransfer = rays == kPictureRays && keepsTransfer(shading);
        if (withTransfer)
            constants.push_back(surface.hasTransfer ? frame::kMesoTransferRead : frame::kMesoTransferKept);
        if (const uint32_t starts = startPlanes(shading, inScene); starts > 0) {
            if (!withTransfer) constants.push_back(0);
            constants.push_back(starts);
        }
        return constants;
    };
    const auto choose = [&](std::span<const uint32_t> spirv, uint32_t rays, uint32_t textures) {
        return resources_.pipeline(spirv, constantsFor(rays, textures));
    };
    if (surface.remeshed.surface) {
        std::vector<uint32_t> constants = constantsFor(kPictureRays, surface.textures);
        constants.resize(kConstantOfAllTiles);
        constants.push_back(surface.heights->hasAll() ? 1 : 0);
        VCP_TRY_ASSIGN(drawing.cast, resources_.pipeline(kRemeshMergeSpirv, constants));
    } else {
        VCP_TRY_ASSIGN(drawing.cast, choose(kMesoSurfaceSpirv, kPictureRays, surface.textures));
    }
    if (!surface.arrays) return {};
    // Rays of light read no textures.
    if (hasMesoShadows(shading)) {
        VkPipeline& lights = inScene ? drawing.sun : drawing.shadow;
        VCP_TRY_ASSIGN(lights, choose(kMesoSurfaceSpirv, inScene ? kRayToLight : kRaysToLights, 0));
    }
    if (inScene && shading.occlusionRays > 0) {
        VCP_TRY_ASSIGN(drawing.sky, choose(kMesoSurfaceSpirv, kRayIntoSky, 0));
    }
    return {};
}

Result<void> MesoSurfacePass::prepare(MesoTarget& target, const Picture& picture, const FrameRequest& request) {
    const PictureSize size = sizeOf(request);
    const bool inScene = picture.sceneLight != nullptr, withTransfer = keepsTransfer(request.shading);
    const uint32_t starts = startPlanes(request.shading, inScene);
    const uint32_t planes = starts > 0 ? starts + frame::kMesoStartPlanes : frame::kMesoPlanes + (withTransfer ? 1 : 0);
    if (!(size == target.size) || planes != target.planes || withTransfer != target.keepsTransfer ||
        target.surfaces != version_ || target.picture != picture.colours->handle() ||
        target.sceneLight != handleOf(picture.sceneLight) || target.depths != picture.depths->handle())
        VCP_TRY(makeTarget(target, size, planes, withTransfer, picture));
    target.remeshed.certifiedPixels = 0, target.remeshed.uncertified = 0;
    for (size_t i = 0; i < surfaces_.size(); ++i) {
        const Placed& surface = surfaces_[i];
        VCP_TRY(choosePipelines(surface, target.drawings[i], request.shading, inScene));
        fillBaseLight(surface, target.drawings[i].baseLight, request.shading);
        if (surface.remeshed.surface)
            VCP_TRY(raster_.remesh(target.remeshed, surface.number, surface.remeshed, *surface.heights,
                                   remeshLook(request)));
    }
    std::vector<uint32_t> shade{0, 0, 0, 0, 0, 0, 0, inScene ? 1u : 0u};
    if (withTransfer) shade.push_back(frame::kMesoTransferKept);
    VCP_TRY_ASSIGN(target.shade, resources_.pipeline(kMesoShadeSpirv, shade));
    return {};
}

Result<void> MesoSurfacePass::chooseCells(const FrameRequest& request, const RemeshShareOut& shareOut) const {
    for (const Placed& surface : surfaces_)
        if (surface.remeshed.surface)
            VCP_TRY(RemeshRaster::chooseCells(surface.remeshed, remeshLook(request), shareOut));
    return {};
}

void MesoSurfacePass::fillBaseLight(const Placed& surface, MesoTarget::Drawing::BaseLight& light,
                                    const Shading& shading) {
    if (light.filled.bytes() == 0) return;
    const auto harmonics = environmentHarmonics(*shading.environment);
    if (harmonics == light.of) return;
    const std::vector<uint64_t> texels = surface.baseTransfer->lightTexels(harmonics);
    std::memcpy(light.filled.mapped(), texels.data(), texels.size() * sizeof(uint64_t));
    light.of = harmonics, light.isCopied = false;
}

bool MesoSurfacePass::keepsTransfer(const Shading& shading) const {
    return readsTransfer(shading) && std::ranges::any_of(surfaces_, &Placed::hasTransfer);
}

uint32_t MesoSurfacePass::startPlanes(const Shading& shading, bool inScene) const {
    const bool casts = hasMesoShadows(shading) || (inScene && shading.occlusionRays > 0);
    const bool any = std::ranges::any_of(surfaces_, [](const Placed& each) { return each.arrays != nullptr; });
    if (remeshed_ == 0 || !casts || !any) return 0;
    return frame::kMesoPlanes + (keepsTransfer(shading) ? 1 : 0);
}

MesoConstants MesoSurfacePass::constantsOf(size_t number, const FrameRequest& request) const {
    const Placed& surface = surfaces_[number];
    MesoConstants c{surface.arrays ? surface.arrays->record : meso::f32::MesoRecord{}, surface.view};
    // Textures are repeated with the tile.
    if (!surface.arrays) c.record.extent = glm::vec3(1, surface.remeshed.surface->heights->rows(), 1);
    setPicture(c.view, surface.origin + movedBy(request, number), request);
    return c;
}

void MesoSurfacePass::dispatch(VkCommandBuffer commands, VkPipeline pipeline, const MesoTarget& target, size_t surface,
                               Rays rays) const {
    const MesoTarget::Drawing& drawing = target.drawings[surface];
    const bool ofLight = rays == Rays::OfLight && surfaces_[surface].remeshed.surface;
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, resources_.layout(), 0, 1,
                            ofLight ? &drawing.lightSet.set : &drawing.set.set, 0, nullptr);
    vkCmdDispatch(commands, (target.size.width + 7) / 8, (target.size.height + 7) / 8, 1);
    barrierComputeToCompute(commands);
}

void MesoSurfacePass::push(VkCommandBuffer commands, const frame::MesoLightRay& ray) const {
    vkCmdPushConstants(commands, resources_.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof ray, &ray);
}

MesoReport MesoTarget::report() const {
    MesoReport report;
    std::memcpy(&report, reported.mapped(), sizeof report);
    return report;
}

void MesoSurfacePass::recordHits(VkCommandBuffer commands, MesoTarget& target, const FrameRequest& request,
                                 const Picture& picture) {
    const uint64_t plane = target.size.pixels() * 4;
    const VkBufferCopy region{0, 0, plane};
    vkCmdCopyBuffer(commands, picture.depths->handle(), target.hits.handle(), 1, &region);
    vkCmdFillBuffer(commands, target.hits.handle(), plane, (target.planes - 1) * plane, 0);
    vkCmdFillBuffer(commands, target.counters.handle(), 0, VK_WHOLE_SIZE, 0);
    for (size_t i = 0; i < surfaces_.size(); ++i) {
        const MesoConstants constants = constantsOf(i, request);
        vkCmdUpdateBuffer(commands, target.drawings[i].constants.handle(), 0, sizeof constants, &constants);
        MesoTarget::Drawing::BaseLight& light = target.drawings[i].baseLight;
        if (light.filled.bytes() == 0 || std::exchange(light.isCopied, true)) continue;
        const VkBufferCopy all{0, 0, light.filled.bytes()};
        vkCmdCopyBuffer(commands, light.filled.handle(), light.texels.buffer.handle(), 1, &all);
    }
    for (size_t i = 0; i < heights_.size(); ++i)
        target.marks[i].picture = heights_[i]->begin(commands), target.marks[i].version = heights_[i]->version();
    barrierToAll(commands);
    for (size_t i = 0; i < surfaces_.size(); ++i) {
        if (surfaces_[i].remeshed.surface)
            raster_.record(commands, target.remeshed, surfaces_[i].number, surfaces_[i].remeshed, remeshLook(request));
        push(commands, {});
        dispatch(commands, target.drawings[i].cast, target, i);
    }
    if (heights_.empty()) return;
    barrierComputeToReadback(commands);
    for (size_t i = 0; i < heights_.size(); ++i) {
        const VkBufferCopy all{0, 0, heights_[i]->marks().bytes()};
        vkCmdCopyBuffer(commands, heights_[i]->marks().handle(), target.marks[i].words.handle(), 1, &all);
    }
    barrierToAll(commands);
}

uint32_t MesoSurfacePass::look(ViewNumber view, const MesoTarget& target) {
    uint32_t missing = 0;
    for (size_t i = 0; i < heights_.size(); ++i) {
        const MesoTarget::Marks& marks = target.marks[i];
        const std::span words(reinterpret_cast<const uint32_t*>(marks.words.mapped()), marks.words.bytes() / 4);
        missing += heights_[i]->look(view, words, marks.picture, marks.version);
    }
    return missing;
}

uint64_t MesoSurfacePass::heightBytes() const {
    uint64_t sum = 0;
    for (const auto& heights : heights_) sum += heights->residentBytes();
    return sum;
}

void MesoSurfacePass::recordRay(VkCommandBuffer commands, const MesoTarget& target, const frame::MesoLightRay& ray) {
    std::vector<size_t> casting;
    for (size_t i = 0; i < surfaces_.size(); ++i)
        if (surfaces_[i].arrays) casting.push_back(i);
    frame::MesoLightRay through = ray;
    for (const size_t i : casting) {
        through.isFirst = ray.isFirst != 0 && i == casting.front() ? 1 : 0;
        through.isLast = ray.isLast != 0 && i == casting.back() ? 1 : 0;
        push(commands, through);
        const bool isSun = ray.number > frame::kSunRay - frame::kMaxLights;
        dispatch(commands, isSun ? target.drawings[i].sun : target.drawings[i].sky, target, i, Rays::OfLight);
    }
}

void MesoSurfacePass::recordShade(VkCommandBuffer commands, const MesoTarget& target, const FrameRequest& request,
                                  const std::optional<PicturePixel>& cursor) {
    const uint64_t plane = target.size.pixels() * 4;
    if (target.sceneLight == VK_NULL_HANDLE && hasMesoShadows(request.shading))
        for (size_t i = 0; i < surfaces_.size(); ++i)
            if (surfaces_[i].arrays) dispatch(commands, target.drawings[i].shadow, target, i, Rays::OfLight);
    push(commands, {.occlusionRays = request.shading.occlusionRays});
    dispatch(commands, target.shade, target, 0);
    barrierComputeToReadback(commands);
    const VkBufferCopy counts{0, offsetof(MesoReport, counts), sizeof(MesoCounts)};
    vkCmdCopyBuffer(commands, target.counters.handle(), target.reported.handle(), 1, &counts);
    if (cursor) {
        const uint64_t at = (uint64_t{cursor->y} * target.size.width + cursor->x) * 4;
        const VkBufferCopy hit[] = {{at, offsetof(MesoReport, cursorDepth), 4},
                                    {plane + at, offsetof(MesoReport, cursorNormal), 4}};
        vkCmdCopyBuffer(commands, target.hits.handle(), target.reported.handle(), 2, hit);
    }
    barrierTransferToHost(commands);
}

}  // namespace vcp
