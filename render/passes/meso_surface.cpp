#include "render/passes/meso_surface.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <tuple>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/gtc/packing.hpp>

#include "render/meso_shade_spirv.h"
#include "render/meso_surface_spirv.h"
#include "render/remesh_merge_spirv.h"

namespace vcp {

namespace {

constexpr VkBufferUsageFlags kConstantsUse = VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;

glm::vec4 toVec4(glm::dvec3 v) { return {glm::vec3(v), 0}; }

/// Returns the words of what is seen from far, followed by the textures.
std::vector<uint64_t> lookOf(const MesoSurface& surface, frame::MesoView& view) {
    std::vector<uint64_t> texels;
    if (surface.far)
        for (const glm::vec4& texel : surface.far->texels) texels.push_back(glm::packHalf4x16(texel));
    const auto add = [&](const MesoTexture* texture, frame::MesoImage& where) {
        if (texture == nullptr) return;
        where = {uint32_t(texels.size()), texture->size.x, texture->size.y, texture->levels};
        texels.insert(texels.end(), texture->texels.begin(), texture->texels.end());
    };
    add(surface.colours.get(), view.colours);
    add(surface.normals.get(), view.normals);
    return texels;
}

RemeshLook remeshLook(const MesoLook& look, PictureSize size) { return {look.camera, look.tile, look.upperLeft, size}; }

}  // namespace

double shadowLift(const meso::MarchArrays& arrays, double tileEdge) {
    const meso::f32::MesoRecord& r = arrays.record;
    const meso::MarchConstants& c = arrays.constants;
    const bool isExact =
        c.walk == meso::f32::kMesoPyramid || c.surface == meso::f32::kMesoHeights || c.surface == meso::f32::kMesoField;
    if (r.fine.x > 0 && (isExact || c.walk == meso::f32::kMesoRelief))
        return (isExact ? 0.25 : 1.5) * tileEdge / r.fine.x;
    // A displacement map is 0 within the solid, and filtered with what lies around.
    return (c.walk >= meso::f32::kMesoGdm ? 1.5 : 0.5) * tileEdge * double(r.cell.x);
}

Result<void> MesoSurfacePass::setSurfaces(std::span<const MesoSurface> surfaces) {
    surfaces_.clear();
    remeshed_ = 0;
    ++version_;
    std::map<const meso::MarchArrays*, std::shared_ptr<MesoTexels>> uploaded;
    std::map<std::tuple<const meso::Appearance*, const MesoTexture*, const MesoTexture*>, std::shared_ptr<MesoTexels>>
        looks;
    std::vector<Placed> placed;
    for (const MesoSurface& surface : surfaces) {
        Placed made;
        made.remeshed = surface.remeshed;
        if (made.remeshed.surface) made.number = remeshed_++;
        made.arrays = surface.arrays;
        if (surface.arrays) {
            auto& words = uploaded[surface.arrays.get()];
            if (!words) {
                VCP_TRY_ASSIGN(auto texels, resources_.words(surface.arrays->words));
                words = std::make_shared<MesoTexels>(std::move(texels));
            }
            made.words = words;
        }
        const std::vector<uint64_t> texels = lookOf(surface, made.view);
        auto& look = looks[{surface.far.get(), surface.colours.get(), surface.normals.get()}];
        if (!look && !texels.empty()) {
            VCP_TRY_ASSIGN(auto uploadedLook, resources_.halfs(texels));
            look = std::make_shared<MesoTexels>(std::move(uploadedLook));
        }
        made.look = look;
        // A surface that rays may come through must be marched.
        made.isFarDrawn = surface.far && (surface.withBase || surface.far->isOpaque);
        made.view.meanHeight = made.isFarDrawn ? float(surface.far->height) : 0.0f;
        if (!made.remeshed.surface) {
            VCP_TRY_ASSIGN(auto shell, resources_.vectors(surface.shell.texels));
            made.shell = std::move(shell);
        }
        VCP_TRY_ASSIGN(made.constants, device_.createBuffer(sizeof(MesoConstants), kConstantsUse, MemoryUse::Local));
        made.origin = surface.shell.origin;
        made.view.nodes = surface.shell.nodes;
        made.view.withBase = surface.withBase ? 1 : 0;
        made.view.shadowLift = float(surface.lift);
        made.view.colour = surface.colour;
        placed.push_back(std::move(made));
    }
    surfaces_ = std::move(placed);
    return {};
}

uint64_t MesoSurfacePass::assetBytes() const {
    std::map<const MesoTexels*, uint64_t> bytes;
    uint64_t sum = 0;
    for (const Placed& surface : surfaces_) {
        if (surface.remeshed.surface)
            sum += surface.remeshed.surface->heights->bytes();
        else
            bytes[surface.words.get()] = surface.words->buffer.bytes(), sum += surface.shell.buffer.bytes();
        if (surface.look) bytes[surface.look.get()] = surface.look->buffer.bytes();
    }
    for (const auto& [texels, count] : bytes) sum += count;
    return sum;
}

Result<void> MesoSurfacePass::makeTarget(MesoTarget& target, PictureSize size, const Buffer& picture) {
    // The target has no size until all of it is made.
    target = {};
    for (const auto& [buffer, bytes] : {std::pair(&target.hits, size.pixels() * frame::kMesoPlanes * 4),
                                        std::pair(&target.counters, uint64_t{sizeof(MesoCounts)})}) {
        VCP_TRY_ASSIGN(*buffer, resources_.storage(bytes));
    }
    VCP_TRY_ASSIGN(target.reported,
                   device_.createBuffer(sizeof(MesoReport), VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Readback));
    if (remeshed_ > 0) VCP_TRY(raster_.prepare(target.remeshed, size, remeshed_));
    for (const Placed& surface : surfaces_) {
        const bool isRemeshed = surface.remeshed.surface != nullptr;
        const auto& [hits, normals] = target.remeshed.copies;
        VCP_TRY_ASSIGN(auto set, resources_.makeSet({&surface.constants, isRemeshed ? &normals : surface.words.get(),
                                                     isRemeshed ? &hits : &surface.shell, &target.hits, &picture,
                                                     &target.counters, surface.look.get()}));
        target.sets.push_back(std::move(set));
    }
    target.size = size, target.surfaces = version_, target.picture = picture.handle();
    return {};
}

Result<void> MesoSurfacePass::choosePipelines(Placed& surface, bool shadows) {
    std::vector<uint32_t> constants =
        surface.arrays ? wordsOf(surface.arrays->constants) : wordsOf(meso::MarchConstants());
    constants.push_back(0);
    constants.push_back((surface.view.colours.levels > 0 ? frame::kMesoColours : 0) |
                        (surface.view.normals.levels > 0 ? frame::kMesoNormals : 0));
    if (surface.remeshed.surface) {
        VCP_TRY_ASSIGN(surface.cast, resources_.pipeline(kRemeshMergeSpirv, constants));
        return {};
    }
    constants.push_back(surface.isFarDrawn ? 1 : 0);
    VCP_TRY_ASSIGN(surface.cast, resources_.pipeline(kMesoSurfaceSpirv, constants));
    if (!shadows) return {};
    // The shadow pass reads no textures.
    constants[4] = 1, constants[5] = 0;
    VCP_TRY_ASSIGN(surface.shadow, resources_.pipeline(kMesoSurfaceSpirv, constants));
    return {};
}

Result<void> MesoSurfacePass::prepare(MesoTarget& target, PictureSize size, const Buffer& picture,
                                      const MesoLook& look) {
    if (!(size == target.size) || target.surfaces != version_ || target.picture != picture.handle())
        VCP_TRY(makeTarget(target, size, picture));
    for (Placed& surface : surfaces_) {
        VCP_TRY(choosePipelines(surface, look.shadows));
        if (surface.remeshed.surface)
            VCP_TRY(raster_.remesh(target.remeshed, surface.number, surface.remeshed, remeshLook(look, size)));
    }
    VCP_TRY_ASSIGN(shade_, resources_.pipeline(kMesoShadeSpirv, {}));
    return {};
}

MesoConstants MesoSurfacePass::constantsOf(const Placed& surface, PictureSize size, const MesoLook& look) const {
    MesoConstants c{surface.arrays ? surface.arrays->record : meso::f32::MesoRecord{}, surface.view};
    // Textures are repeated with the tile.
    if (surface.remeshed.surface) c.record.extent = glm::vec3(1, surface.remeshed.surface->heights->rows(), 1);
    const PictureTile& tile = look.tile;
    const CameraBasis basis = cameraBasis(look.camera, tile.fullWidth, tile.fullHeight);
    const glm::dvec3 stepX = basis.right * (2 * basis.halfWidth / tile.fullWidth),
                     stepY = basis.up * (-2 * basis.halfHeight / tile.fullHeight);
    const glm::dvec3 corner = basis.up * basis.halfHeight - basis.right * basis.halfWidth + look.upperLeft.x * stepX +
                              look.upperLeft.y * stepY;
    const glm::dvec3 eye = look.camera.eye - surface.origin;
    if (look.camera.projection == Projection::Orthographic) {
        c.view.eye = toVec4(eye + corner), c.view.eyeX = toVec4(stepX), c.view.eyeY = toVec4(stepY);
        c.view.forward = toVec4(basis.forward);
    } else {
        c.view.eye = toVec4(eye);
        c.view.forward = toVec4(basis.forward + corner), c.view.forwardX = toVec4(stepX),
        c.view.forwardY = toVec4(stepY);
    }
    c.view.width = size.width, c.view.height = size.height;
    c.view.light = look.light;
    c.view.strayPixels = float(look.errorPixels), c.view.farShadows = look.shadows ? 1 : 0;
    c.view.up = look.up;
    c.view.shows = uint32_t(look.shading);
    c.view.sectionCount = uint32_t(look.sections.size());
    for (size_t i = 0; i < look.sections.size(); ++i) {
        const double length = glm::length(look.sections[i].normal);
        const glm::dvec3 normal = look.sections[i].normal / length;
        c.view.sections[i] = glm::dvec4(normal, glm::dot(normal, surface.origin) - look.sections[i].offset / length);
    }
    return c;
}

void MesoSurfacePass::dispatch(VkCommandBuffer commands, VkPipeline pipeline, const MesoTarget& target,
                               size_t surface) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, resources_.layout(), 0, 1,
                            &target.sets[surface].set, 0, nullptr);
    vkCmdDispatch(commands, (target.size.width + 7) / 8, (target.size.height + 7) / 8, 1);
    barrierComputeToCompute(commands);
}

MesoReport MesoTarget::report() const {
    MesoReport report;
    std::memcpy(&report, reported.mapped(), sizeof report);
    return report;
}

void MesoSurfacePass::record(VkCommandBuffer commands, const MesoTarget& target, const MesoLook& look,
                             const Buffer& depths, const std::optional<PicturePixel>& cursor) {
    const uint64_t plane = target.size.pixels() * 4;
    const VkBufferCopy region{0, 0, plane};
    vkCmdCopyBuffer(commands, depths.handle(), target.hits.handle(), 1, &region);
    vkCmdFillBuffer(commands, target.hits.handle(), plane, 3 * plane, 0);
    vkCmdFillBuffer(commands, target.counters.handle(), 0, VK_WHOLE_SIZE, 0);
    for (const Placed& surface : surfaces_) {
        const MesoConstants constants = constantsOf(surface, target.size, look);
        vkCmdUpdateBuffer(commands, surface.constants.handle(), 0, sizeof constants, &constants);
    }
    barrierToAll(commands);
    for (size_t i = 0; i < surfaces_.size(); ++i) {
        if (surfaces_[i].remeshed.surface)
            raster_.record(commands, target.remeshed, surfaces_[i].number, surfaces_[i].remeshed,
                           remeshLook(look, target.size));
        dispatch(commands, surfaces_[i].cast, target, i);
    }
    if (look.shadows && look.shading == MesoShading::Lit)
        for (size_t i = 0; i < surfaces_.size(); ++i)
            if (!surfaces_[i].remeshed.surface) dispatch(commands, surfaces_[i].shadow, target, i);
    dispatch(commands, shade_, target, 0);
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
