// findColours, compiled for several instruction sets, as castTile is (tile_caster.cpp).
#include "render/host/tile_colours.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>

#include "octree/imaged_triangle.h"
#include "octree/page/page_triangles.h"
#include "render/host/hit_surface.h"
#include "render/host/instruction_sets.h"

#ifndef VCP_RENDER_HOST_TILE_COLOURS
#define VCP_RENDER_HOST_TILE_COLOURS
namespace vcp {

/// A triangle in an image: what its pixels share.
struct ImagedLeaf {
    ImagedTriangle triangle;
    /// What lanes gather, each at its place below. Slopes are of coordinates, by cells of the page's level.
    float numbers[32];
};
enum ImagedNumber {
    kPlace = 0,
    kToB = 2,
    kToC = 4,
    kSlopeU = 6,
    kSlopeV = 9,
    kNormal = 12,    // unit
    kCells = 15,     // footprints are so much wider than the pixel's edge in finest cells
    kSize = 16,      // of the image, texels
    kFinest = 18,    // number of its finest level in memory
    kCoarsest = 19,  // and of its last one
    kFactor = 20,
};
constexpr size_t kImagedStride = sizeof(ImagedLeaf) / sizeof(float);
static_assert(sizeof(ImagedLeaf) % sizeof(float) == 0);

/// The pixels of a tile that images are seen at; after the last one it is repeated, so that lanes are full.
struct ImagedPixels {
    size_t count = 0;
    alignas(32) uint32_t pixel[kTilePixels + 8];  // element of the tile's arrays
    alignas(32) uint32_t leaf[kTilePixels + 8];   // number of its ImagedLeaf
};

}  // namespace vcp
#endif

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/host/tile_colours.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <hwy/contrib/math/math-inl.h>

#include "render/host/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vcp::HWY_NAMESPACE {

HWY_INLINE Lane floor(Lane x) { return hn::Floor(x.v); }
HWY_INLINE Lane log2(Lane x) { return hn::Log2(Floats(), x.v); }
HWY_INLINE Lane3 normalize(Lane3 v) { return (Lane(1.0f) / sqrt(dot(v, v))) * v; }

// The shared lookup of images, for lanes.
#define INLINE HWY_INLINE
#define FOR_LANES
#define Real Lane
#define Real2 Lane2
#define Real3 Lane3
#define SELECT select
#include "octree/shared/image_lookup.h"
#undef INLINE
#undef FOR_LANES
#undef Real
#undef Real2
#undef Real3
#undef SELECT

/// What the leaves of several pixels say.
class LeafNumbers {
public:
    LeafNumbers(const ImagedLeaf* leaves, LaneWords number)
        : numbers_(leaves->numbers), at_(hn::Mul(number, hn::Set(Words(), uint32_t(kImagedStride)))) {}

    [[nodiscard]] HWY_INLINE Lane at(int i) const { return gatherFloats(numbers_ + i, at_); }
    [[nodiscard]] HWY_INLINE Lane2 pairAt(int i) const { return {at(i), at(i + 1)}; }
    [[nodiscard]] HWY_INLINE Lane3 vectorAt(int i) const { return {at(i), at(i + 1), at(i + 2)}; }

private:
    const float* numbers_;
    LaneWords at_;
};

/// The light of texels and their alpha, each times a weight.
struct LightSum {
    Lane3 light;
    Lane alpha;

    HWY_INLINE LightSum() : light(0.0f, 0.0f, 0.0f), alpha(0.0f) {}
    HWY_INLINE void add(const float* lightOfByte, LaneWords texel, Lane weight) {
        const LaneWords byte = hn::Set(Words(), 255u), alphas = hn::ShiftRight<24>(texel);
        if (!hn::AllTrue(Words(), hn::Eq(alphas, byte))) weight = weight * toFloats(alphas) * Lane(1.0f / 255);
        const auto lightOf = [&](LaneWords channel) { return gatherFloats(lightOfByte, hn::And(channel, byte)); };
        light.x = mulAdd(weight, lightOf(texel), light.x);
        light.y = mulAdd(weight, lightOf(hn::ShiftRight<8>(texel)), light.y);
        light.z = mulAdd(weight, lightOf(hn::ShiftRight<16>(texel)), light.z);
        alpha = alpha + weight;
    }
};

/// Where several pixels are read: each in a level of its own image.
struct LevelsRead {
    const ImagedTriangle* triangle[kLanes];
    size_t level[kLanes];
    const ImageSet::Level* same;  // that of all; null where they have several
    alignas(32) float width[kLanes], height[kLanes];
    alignas(32) int32_t column[kLanes], row[kLanes];
    alignas(32) uint32_t texels[4][kLanes];
};

/// Reads the texels of several pixels at once; false where they are not all in one tile, or it is not in memory.
HWY_INLINE bool readAtOnce(LevelsRead& read, Lane column, Lane row) {
    if (read.same == nullptr) return false;
    const ImageSet::Level& level = *read.same;
    const uint32_t edge = 1u << level.log2Edge;
    const auto first = glm::uvec2(uint32_t(read.column[0]), uint32_t(read.row[0])) & ~(edge - 1);
    // A column or a row left of the image is a large number.
    if (first.x >= level.width || first.y >= level.height) return false;
    const uint32_t width = std::min(edge, level.width - first.x), height = std::min(edge, level.height - first.y);
    const Lane x = column - Lane(float(first.x)), y = row - Lane(float(first.y)), zero(0.0f);
    const Mask isInside = ((x >= zero) & (y >= zero)) & ((x < Lane(float(width - 1))) & (y < Lane(float(height - 1))));
    if (!hn::AllTrue(Floats(), isInside)) return false;
    const uint32_t* const tile = level.tileOf(first.x, first.y);
    if (tile == nullptr) return false;
    const LaneWords at = hn::BitCast(Words(), hn::ConvertTo(Integers(), mulAdd(y, Lane(float(width)), x).v));
    hn::Store(gather(tile, at), Words(), read.texels[0]);
    hn::Store(gather(tile + 1, at), Words(), read.texels[1]);
    hn::Store(gather(tile + width, at), Words(), read.texels[2]);
    hn::Store(gather(tile + width + 1, at), Words(), read.texels[3]);
    return true;
}

/// Reads the texels of each pixel by itself, of the next coarser level where they are not in memory.
HWY_INLINE void readEach(LevelsRead& read, Lane2 at, float* fx, float* fy) {
    alignas(32) float x[kLanes], y[kLanes];
    store(at.x, x);
    store(at.y, y);
    for (int i = 0; i < kLanes; ++i) {
        const ImagedTriangle& t = *read.triangle[i];
        TexelQuad quad;
        if (!findTexels(t.image->levels[read.level[i]], t.wraps, {read.column[i], read.row[i]}, quad)) {
            quad = texelsAround(*t.image, read.level[i] + 1, t.wraps, {x[i], y[i]});
            fx[i] = quad.fx, fy[i] = quad.fy;
        }
        for (int k = 0; k < 4; ++k) read.texels[k][i] = quad.texels[k];
    }
}

/// Adds what the levels show at several points, between four texels.
HWY_INLINE void addBilinear(const float* lightOfByte, LevelsRead& read, Lane2 at, Lane weight, LightSum& sum) {
    const Lane x = boundedPlace(at.x * load(read.width) - Lane(0.5f));
    const Lane y = boundedPlace(at.y * load(read.height) - Lane(0.5f));
    const Lane column = floor(x), row = floor(y);
    hn::Store(hn::ConvertTo(Integers(), column.v), Integers(), read.column);
    hn::Store(hn::ConvertTo(Integers(), row.v), Integers(), read.row);
    alignas(32) float fx[kLanes], fy[kLanes];
    store(x - column, fx);
    store(y - row, fy);
    if (!readAtOnce(read, column, row)) readEach(read, at, fx, fy);
    const Lane right = load(fx), lower = load(fy), left = Lane(1.0f) - right, upper = Lane(1.0f) - lower;
    const auto texel = [&](int k) { return hn::Load(Words(), read.texels[k]); };
    sum.add(lightOfByte, texel(0), weight * upper * left);
    sum.add(lightOfByte, texel(1), weight * upper * right);
    sum.add(lightOfByte, texel(2), weight * lower * left);
    sum.add(lightOfByte, texel(3), weight * lower * right);
}

/// Sets the levels that lanes read; `further`: so many after those of `finer`.
HWY_INLINE void setLevels(const float* finer, size_t further, LevelsRead& read) {
    for (int i = 0; i < kLanes; ++i) {
        const auto& levels = read.triangle[i]->image->levels;
        read.level[i] = std::min(size_t(finer[i]) + further, levels.size() - 1);
        const ImageSet::Level& level = levels[read.level[i]];
        read.width[i] = float(level.width);
        read.height[i] = float(level.height);
        read.same = i == 0 || read.same == &level ? &level : nullptr;
    }
}

/// Returns stored values of light.
HWY_INLINE Lane storedOf(const float* storedOfRoot, Lane light) {
    const Lane at = sqrt(min(max(light, Lane(0.0f)), Lane(1.0f))) * Lane(float(ColourTables::kRoots));
    const Lane below = floor(at);
    const LaneWords index = hn::BitCast(Words(), hn::ConvertTo(Integers(), below.v));
    const Lane low = gatherFloats(storedOfRoot, index), high = gatherFloats(storedOfRoot + 1, index);
    return mulAdd(at - below, high - low, low);
}

HWY_INLINE LaneWords byteOf(Lane x) {
    const Lane scaled = min(max(x, Lane(0.0f)), Lane(1.0f)) * Lane(255.0f) + Lane(0.5f);
    return hn::BitCast(Words(), hn::ConvertTo(Integers(), scaled.v));
}

/// Returns the colours of light, encoded, times a factor; 0 where nothing is opaque.
HWY_INLINE LaneWords coloursOf(const ColourTables& tables, const LightSum& sum, const LeafNumbers& leaf) {
    const Mask isSeen = sum.alpha > Lane(0.0f);
    const Lane scale = Lane(1.0f) / select(isSeen, sum.alpha, Lane(1.0f));
    const float* const stored = tables.storedOfRoots();
    const LaneWords red = byteOf(storedOf(stored, sum.light.x * scale) * leaf.at(kFactor)),
                    green = byteOf(storedOf(stored, sum.light.y * scale) * leaf.at(kFactor + 1)),
                    blue = byteOf(storedOf(stored, sum.light.z * scale) * leaf.at(kFactor + 2)),
                    alpha = byteOf(sum.alpha * leaf.at(kFactor + 3));
    const LaneWords colour =
        hn::Or(hn::Or(red, hn::ShiftLeft<8>(green)), hn::Or(hn::ShiftLeft<16>(blue), hn::ShiftLeft<24>(alpha)));
    return hn::IfThenElseZero(hn::RebindMask(Words(), isSeen), colour);
}

void filterHere(const PictureRays& rays, const PixelEdges& edges, const TileHits& hits, const ImagedLeaf* leaves,
                const ImagedPixels& pixels, uint32_t* colours) {
    const ColourTables& tables = ColourTables::get();
    const glm::vec3 first(rays.directionAt(hits.corner.x + 0.5, hits.corner.y + 0.5)), perX(rays.directionPerX),
        perY(rays.directionPerY);
    for (size_t k = 0; k < pixels.count; k += kLanes) {
        const LaneWords pixel = hn::Load(Words(), pixels.pixel + k);
        const LeafNumbers leaf(leaves, hn::Load(Words(), pixels.leaf + k));
        const Lane column = toFloats(hn::And(pixel, hn::Set(Words(), uint32_t(kTileWidth - 1))));
        const Lane row = toFloats(hn::ShiftRight<std::countr_zero(unsigned(kTileWidth))>(pixel));
        const Lane3 direction = normalize(mulAdd(row, spread(perY), mulAdd(column, spread(perX), spread(first))));
        const Lane edge = mulAdd(Lane(edges.perDepth), gatherFloats(hits.depth, pixel), Lane(edges.edge));
        const TextureSlope slope{leaf.vectorAt(kSlopeU), leaf.vectorAt(kSlopeV)};
        const ImageFootprint footprint =
            imageFootprint(slope, leaf.vectorAt(kNormal), direction, edge * leaf.at(kCells), leaf.pairAt(kSize));
        const ImagePlaces places = imagePlaces(footprint, leaf.at(kFinest), leaf.at(kCoarsest));
        const Lane b = gatherFloats(hits.x, pixel), c = gatherFloats(hits.y, pixel);
        const Lane2 at = leaf.pairAt(kPlace) + (b * leaf.pairAt(kToB) + c * leaf.pairAt(kToC));
        const Lane part = Lane(1.0f) / places.count, finer = floor(places.level), coarser = places.level - finer;
        LevelsRead read[2];
        alignas(32) float levels[kLanes], counts[kLanes];
        store(finer, levels);
        store(places.count, counts);
        for (int i = 0; i < kLanes; ++i)
            read[0].triangle[i] = read[1].triangle[i] = &leaves[pixels.leaf[k + size_t(i)]].triangle;
        setLevels(levels, 0, read[0]);
        setLevels(levels, 1, read[1]);
        const float most = *std::max_element(counts, counts + kLanes);
        LightSum sum;
        for (float i = 0; i < most; ++i) {
            const Lane weight = select(Lane(i) < places.count, part, Lane(0.0f));
            const Lane2 place = at + (Lane(i + 0.5f) * part - Lane(0.5f)) * places.along;
            addBilinear(tables.lightOfBytes(), read[0], place, weight * (Lane(1.0f) - coarser), sum);
            if (any(coarser > Lane(0.0f))) addBilinear(tables.lightOfBytes(), read[1], place, weight * coarser, sum);
        }
        alignas(32) uint32_t found[kLanes];
        hn::Store(coloursOf(tables, sum, leaf), Words(), found);
        for (int i = 0; i < kLanes; ++i) colours[pixels.pixel[k + size_t(i)]] = found[i];
    }
}

}  // namespace vcp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcp {

HWY_EXPORT(filterHere);

namespace {

/// Finds the triangle of a hit in its image; nothing where the hit has none.
std::optional<ImagedLeaf> imagedLeaf(const HostScene& scene, const HitLeaf& leaf) {
    if (nodeType(leaf.node) != kNodeHard) return {};
    const HostScene::Page& page = scene.page(leaf.page);
    const auto triangle = imagedTriangle(*scene.images(), *page.view, leaf.corners);
    if (!triangle) return {};
    const auto p = cornersOf(*page.view, leaf.corners);
    const glm::vec3 n = glm::cross(p[1] - p[0], p[2] - p[0]);
    const f32::TextureSlope slope = f32::textureSlope(p[0], p[1], p[2], triangle->toB, triangle->toC);
    ImagedLeaf found{*triangle, {}};
    const auto put = [&](int at, const auto& v) {
        for (int i = 0; i < v.length(); ++i) found.numbers[at + i] = v[i];
    };
    put(kPlace, triangle->place);
    put(kToB, triangle->toB);
    put(kToC, triangle->toC);
    put(kSlopeU, slope.u);
    put(kSlopeV, slope.v);
    put(kNormal, n * glm::inversesqrt(std::max(glm::dot(n, n), 1e-30f)));
    put(kSize, glm::vec2(float(triangle->image->width), float(triangle->image->height)));
    put(kFactor, triangle->factor);
    found.numbers[kCells] = std::ldexp(f32::kFootprintPixels, -int(page.cellBits));
    found.numbers[kFinest] = float(triangle->image->finest);
    found.numbers[kCoarsest] = float(triangle->image->levels.size() - 1);
    return found;
}

}  // namespace

void findColours(const HostScene& scene, const PictureRays& rays, const PixelEdges& edges, const TileHits& hits,
                 uint32_t (&colours)[kTilePixels]) {
    constexpr int32_t kUnknown = -1, kWithout = -2;
    std::vector<int32_t> numberOf(hits.leaves.size(), kUnknown);  // of hits.leaves in `leaves`
    std::vector<ImagedLeaf> leaves;
    ImagedPixels pixels;
    const auto isImaged = [&](uint32_t leaf) {
        if (numberOf[leaf] == kUnknown) {
            auto found = imagedLeaf(scene, hits.leaves[leaf]);
            numberOf[leaf] = found ? int32_t(leaves.size()) : kWithout;
            if (found) leaves.push_back(*found);
        }
        return numberOf[leaf] != kWithout;
    };
    for (int y = 0; y < hits.size.y; ++y)
        for (int x = 0; x < hits.size.x; ++x) {
            const int i = y * kTileWidth + x;
            if (!std::isfinite(hits.depth[i]) || hits.onCap[size_t(i)]) continue;
            const uint32_t leaf = hits.leaf[i];
            if (scene.images() != nullptr && !hits.blended[size_t(i)] && isImaged(leaf)) {
                pixels.pixel[pixels.count] = uint32_t(i);
                pixels.leaf[pixels.count++] = uint32_t(numberOf[leaf]);
            } else {
                colours[i] = packedColour(colourAt(scene, hits, i));
            }
        }
    if (pixels.count == 0) return;
    for (size_t k = pixels.count; k % 8 != 0; ++k) {
        pixels.pixel[k] = pixels.pixel[pixels.count - 1];
        pixels.leaf[k] = pixels.leaf[pixels.count - 1];
    }
    HWY_DYNAMIC_DISPATCH(filterHere)(rays, edges, hits, leaves.data(), pixels, colours);
}

}  // namespace vcp
#endif
