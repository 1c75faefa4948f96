#include "render/host/tile_channels.h"

#include <array>
#include <cmath>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "octree/imaged_triangle.h"
#include "octree/page/page_triangles.h"
#include "render/host/channel_light.h"
#include "render/host/hit_surface.h"

namespace vcp {

namespace {

/// A triangle whose material has channels: what its pixels share.
struct ChannelledLeaf {
    ImagedTriangle triangle;
    const ChannelRow* channels;
    f32::TextureSlope slope;  // by cells of the page's level
    glm::vec3 normal;         // of the triangle, unit
    float cells;              // footprints are so much wider than the pixel's edge in finest cells
};

std::optional<ChannelledLeaf> channelledLeaf(const HostScene& scene, const HitLeaf& leaf) {
    if (nodeType(leaf.node) != kNodeHard) return {};
    const HostScene::Page& page = scene.page(leaf.page);
    const auto triangle = imagedTriangle(*scene.images(), *page.view, leaf.corners);
    const ChannelRow* const channels = triangle ? scene.images()->channelsOf(triangle->material) : nullptr;
    if (channels == nullptr) return {};
    const auto p = cornersOf(*page.view, leaf.corners);
    const glm::vec3 n = glm::cross(p[1] - p[0], p[2] - p[0]);
    return ChannelledLeaf{*triangle, channels, f32::textureSlope(p[0], p[1], p[2], triangle->toB, triangle->toC),
                          n * glm::inversesqrt(std::max(glm::dot(n, n), 1e-30f)),
                          std::ldexp(f32::kFootprintPixels, -int(page.cellBits))};
}

/// Where a hit is in the images of its material, and how wide its pixel is.
struct ImagedHit {
    glm::vec2 at;
    glm::vec3 direction;  // of the ray, unit
    float pixelEdge;      // cells of the page's level
};

HitChannels channelsAt(const ImageSet& images, const ChannelledLeaf& leaf, const ImagedHit& hit, glm::vec3 normal) {
    const ChannelRow& row = *leaf.channels;
    const auto placesIn = [&](const ImageSet::Image& image) {
        const glm::vec2 size(float(image.width), float(image.height));
        return placesOf(image, f32::imageFootprint(leaf.slope, leaf.normal, hit.direction, hit.pixelEdge, size));
    };
    const auto numbersIn = [&](uint32_t number) {
        const ImageSet::Image& image = images.images()[number - 1];
        return filteredNumbers(image, leaf.triangle.wraps, hit.at, placesIn(image));
    };
    HitChannels found{.normal = normal,
                      .towardsEye = -hit.direction,
                      .emission = {row.emissionFactor[0], row.emissionFactor[1], row.emissionFactor[2]},
                      .roughness = row.roughness,
                      .metalness = row.metalness};
    if (row.surface != 0) {
        const glm::vec3 numbers = numbersIn(row.surface);
        found.roughness *= numbers.y;
        found.metalness *= numbers.z;
    }
    if (row.normals != 0) {
        const f32::MappedNormal mapped = f32::mappedNormal(normal, leaf.slope, numbersIn(row.normals), row.normalScale);
        // One that leans away from the ray is bent back to it.
        found.normal =
            glm::normalize(mapped.normal - std::max(glm::dot(mapped.normal, hit.direction), 0.0f) * hit.direction);
        found.roughness = f32::roughnessWithin(found.roughness, mapped.spread);
    }
    if (row.emission != 0) {
        const ImageSet::Image& image = images.images()[row.emission - 1];
        found.emission *=
            f32::lightOfColour(glm::vec3(filteredColour(image, leaf.triangle.wraps, hit.at, placesIn(image))));
    }
    return found;
}

/// Returns the light that a surface sends to the eye. `sun`, `sky`: as of TileSurface.
glm::vec3 lightFrom(const frame::FrameConstants& frame, const f32::LitSurface& surface, const HitChannels& hit,
                    float sun, float sky) {
    glm::vec3 light = surface.emission;
    const uint32_t seen = packedColour(glm::vec4(sun, 0, 0, 0)) & 255u;
    for (uint32_t i = 0; i < frame.lightCount; ++i) {
        const glm::vec4 from = lightNumbered(frame, i);
        const float isSeen = frame.lightCount == 1 ? sun : float(seen >> i & 1u);
        const float falling = from.w * f32::sunlightOf(hit.normal, glm::vec3(from), isSeen) * (0.5f + 0.5f * sky);
        if (falling > 0) light += falling * f32::reflectedPart(surface, hit.normal, glm::vec3(from), hit.towardsEye);
    }
    const glm::vec3 seenAt = f32::seenDirection(surface, hit.normal, hit.towardsEye);
    const f32::ReflectedParts parts = f32::reflectedParts(surface, hit.normal, hit.towardsEye);
    const auto surroundings = [&](glm::vec3 n) {
        return frame.hasEnvironment != 0 ? f32::environmentLight(n, frame.environment)
                                         : glm::vec3(f32::skylight(n, glm::vec3(frame.upDirection)));
    };
    return light + sky * (parts.matt * surroundings(hit.normal) + parts.mirrored * surroundings(seenAt));
}

}  // namespace

std::vector<PixelChannels> findChannels(const HostScene& scene, const PictureRays& rays, const PixelEdges& edges,
                                        const TileHits& hits, const TileSurface& surface) {
    std::vector<PixelChannels> found;
    std::vector<std::optional<ChannelledLeaf>> leaves;
    for (const HitLeaf& leaf : hits.leaves) leaves.push_back(channelledLeaf(scene, leaf));
    for (int y = 0; y < hits.size.y; ++y)
        for (int x = 0; x < hits.size.x; ++x) {
            const int i = y * kTileWidth + x;
            if (!std::isfinite(hits.depth[i]) || hits.onCap[size_t(i)] || hits.blended[size_t(i)]) continue;
            const auto& leaf = leaves[hits.leaf[i]];
            if (!leaf) continue;
            const glm::vec3 direction(
                glm::normalize(rays.directionAt(hits.corner.x + x + 0.5, hits.corner.y + y + 0.5)));
            const float edge = edges.edge + edges.perDepth * hits.depth[i];
            const ImagedHit hit{leaf->triangle.at(hits.x[i], hits.y[i]), direction, edge * leaf->cells};
            found.push_back({i, channelsAt(*scene.images(), *leaf, hit, surface.normal(i))});
        }
    return found;
}

void shadeChannels(const frame::FrameConstants& frame, const TileSurface& surface,
                   const std::vector<PixelChannels>& channels, uint32_t (&colours)[kTilePixels]) {
    const std::array<float, 256>& lightOf = lightOfColourBytes();
    for (const auto& [i, hit] : channels) {
        const uint32_t colour = packedColour({surface.red[i], surface.green[i], surface.blue[i], 1});
        const glm::vec3 albedo(lightOf[colour & 255u], lightOf[colour >> 8 & 255u], lightOf[colour >> 16 & 255u]);
        const f32::LitSurface lit{albedo, hit.roughness, hit.metalness, hit.emission};
        const glm::vec3 light = lightFrom(frame, lit, hit, surface.sun[i], surface.sky[i]);
        colours[i] = packedColour(glm::vec4(f32::colourOfLight(light), 1));
    }
}

}  // namespace vcp
