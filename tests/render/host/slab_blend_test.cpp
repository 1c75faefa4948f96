// Blended slab leaves of the host's pictures: normals against the reference's, pixel by pixel, and colours.
#include "render/host/slab_blend.h"

#include <cmath>

#include <gtest/gtest.h>

#include "render/host/hit_surface.h"
#include "render/host/host_caster.h"
#include "tests/support/reference_comparison.h"
#include "tests/support/test_scene.h"

namespace vcp {
namespace {

constexpr uint32_t kWidth = 160, kHeight = 120;
const glm::dvec3 kCentre = 64.0 * glm::dvec3(0.503, 0.497, 0.501);
constexpr double kRadius = 26;

test::AnalyticDataset slabSphere() {
    test::AnalyticOptions o;
    o.levels = o.slabLevels = 3;
    return test::analyticDataset(test::sphere(kCentre, kRadius), o);
}

/// Calls visit(hits, element, ray) for each hit of a picture, its slabs blended.
template <class Visit>
void forEachHit(const HostScene& scene, const Camera& camera, const CastOptions& pixels, const Visit& visit) {
    const PictureRays rays = pictureRays(camera, kWidth, kHeight);
    const double cell = scene.grid().cell;
    const auto cast = castPicture(scene, rays, {.threads = 1}, [&](const TileHits& unblended) {
        TileHits hits = unblended;
        blendSlabs(scene, {float(pixels.pixelEdge / cell), float(pixels.pixelEdgePerT)}, hits);
        for (int i = 0; hits.any && i < kTilePixels; ++i) {
            const glm::ivec2 in(i % kTileWidth, i / kTileWidth), at = hits.corner + in;
            if (in.x >= hits.size.x || in.y >= hits.size.y || std::isinf(hits.depth[i])) continue;
            visit(hits, i, cameraRay(camera, kWidth, kHeight, at.x + 0.5, at.y + 0.5));
        }
    });
    EXPECT_TRUE(cast);
}

glm::dvec3 bent(glm::dvec3 normal, glm::dvec3 direction) {
    normal = glm::normalize(normal);
    return glm::normalize(normal - std::max(glm::dot(normal, direction), 0.0) * direction);
}

glm::dvec3 normalOf(const TileHits& hits, int i, glm::dvec3 direction) {
    return bent({hits.normalX[i], hits.normalY[i], hits.normalZ[i]}, direction);
}

struct Counts {
    uint64_t hits = 0, blended = 0, otherNormal = 0;
    double plainOff = 0, blendedOff = 0;  ///< angles to the sphere's normal, summed
};

Counts compareWithReference(const PageCache& cache, const std::vector<uint64_t>& cut, const Camera& camera) {
    const auto scene = HostScene::create(cache, cut);
    const CastOptions pixels = test::castOptions(camera, kWidth, kHeight);
    const auto reference = ReferenceCaster::create(cache, cut, pixels), plain = ReferenceCaster::create(cache, cut);
    EXPECT_TRUE(scene && reference && plain);
    Counts counts;
    forEachHit(*scene, camera, pixels, [&](const TileHits& hits, int i, const CameraRay& ray) {
        if (i % 4 != 0) return;  // the reference is slow
        const auto expected = reference->cast({ray.origin, ray.direction});
        if (!expected || std::abs(double(hits.depth[i]) - expected->t) > 0.01) return;
        ++counts.hits;
        counts.blended += hits.blended[size_t(i)] ? 1 : 0;
        const glm::dvec3 normal = normalOf(hits, i, ray.direction), out = glm::normalize(expected->position - kCentre);
        const double angle = std::acos(std::min(1.0, glm::dot(normal, expected->normal)));
        counts.otherNormal += angle > test::kSameNormal ? 1 : 0;
        const glm::dvec3 truth = bent(f64::turnedTo(out, -ray.direction), ray.direction);
        counts.blendedOff += glm::distance(normal, truth);
        counts.plainOff += glm::distance(plain->cast({ray.origin, ray.direction})->normal, truth);
    });
    return counts;
}

TEST(HostSlabBlend, EveryCameraAgreesWithTheReference) {
    const test::Scene scene = test::sceneOf("slabs", slabSphere());
    const Dataset& dataset = *scene.dataset;
    uint64_t hits = 0, blended = 0, otherNormals = 0;
    for (const auto& cut :
         {cutAtLevel(dataset, 0), cutAtLevel(dataset, 1), cutAtLevel(dataset, 2), test::mixedCut(dataset)}) {
        SCOPED_TRACE(cut.size());
        for (const test::NamedCamera& named : test::cameras(scene)) {
            SCOPED_TRACE(named.name);
            const Counts c = compareWithReference(*scene.cache, cut, named.camera);
            EXPECT_GT(c.hits, 250u);
            hits += c.hits, blended += c.blended, otherNormals += c.otherNormal;
            // Where all leaves are blended, be it by a tenth, the sphere becomes rounder.
            if (c.blended == c.hits) {
                EXPECT_LT(c.blendedOff, 0.85 * c.plainOff);
            }
        }
    }
    EXPECT_GT(blended, 20000u);
    EXPECT_LE(otherNormals * 1000, hits) << otherNormals << " of " << hits;
}

TEST(HostSlabBlend, NarrowLeavesStayAsTheyAre) {
    const test::Scene scene = test::sceneOf("slabs", slabSphere());
    const auto host = HostScene::create(*scene.cache, cutAtLevel(*scene.dataset, 2));
    const Camera camera = test::cameras(scene)[0].camera;
    uint64_t hits = 0;
    forEachHit(*host, camera, {.pixelEdge = 1}, [&](const TileHits& tile, int i, const CameraRay& ray) {
        ++hits;
        EXPECT_FALSE(tile.blended[size_t(i)]);
        const glm::dvec3 alone = bent(surfaceAt(*host, tile, i, ray.direction).normal, ray.direction);
        EXPECT_LT(glm::distance(normalOf(tile, i, ray.direction), alone), 1e-5);
    });
    EXPECT_GT(hits, 2000u);
}

/// Each vector's colour follows its leaf's normal.
test::AnalyticDataset paintedSphere() {
    test::AnalyticDataset made = slabSphere();
    made.dataset.header.flags |= kFlagColour;
    for (size_t page = 0; page < made.pages.size(); ++page) {
        PageBytes& bytes = made.pages[page];
        const PageView view = *parsePage(bytes.geometryBytes());
        bytes.colour.assign(colourPageBytes(view.header) / 16, uint4(0));
        auto* words = reinterpret_cast<uint32_t*>(bytes.colour.data());
        for (uint32_t i = 0; i < view.header.slabLeaves; ++i) {
            const glm::vec3 n = f32::decodeDirection(vectorWord(view.faces, i) >> kSlabDirectionShift);
            words[i] = 0xff000000u | uint32_t(255 * std::abs(n.x)) | uint32_t(255 * std::abs(n.y)) << 8 |
                       uint32_t(255 * std::abs(n.z)) << 16;
        }
        made.dataset.pages[page].colourBytes = uint32_t(colourPageBytes(view.header));
    }
    return made;
}

TEST(HostSlabBlend, ColoursAreBlendedLikewise) {
    const test::Scene scene = test::sceneOf("painted slabs", paintedSphere());
    const auto host = HostScene::create(*scene.cache, cutAtLevel(*scene.dataset, 0));
    const Camera camera = test::cameras(scene)[0].camera;
    double blendedOff = 0, plainOff = 0;
    uint64_t hits = 0;
    forEachHit(*host, camera, test::castOptions(camera, kWidth, kHeight),
               [&](const TileHits& tile, int i, const CameraRay& ray) {
                   ++hits;
                   EXPECT_TRUE(tile.blended[size_t(i)]);
                   const glm::dvec3 at = ray.origin + double(tile.depth[i]) * ray.direction;
                   const glm::vec3 truth = glm::abs(glm::vec3(glm::normalize(at - kCentre)));
                   blendedOff += glm::distance(glm::vec3(colourAt(*host, tile, i)), truth);
                   TileHits alone = tile;
                   alone.blended.reset();
                   plainOff += glm::distance(glm::vec3(colourAt(*host, alone, i)), truth);
               });
    EXPECT_GT(hits, 2000u);
    EXPECT_GT(plainOff, 0.02 * double(hits)) << "there is something to mend";
    EXPECT_LT(blendedOff, 0.6 * plainOff);
}

}  // namespace
}  // namespace vcp
