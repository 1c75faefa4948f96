// findColours, compiled for several instruction sets, as castTile is (tile_caster.cpp).
#include "render/host/tile_colours.h"

#include <algorithm>
#include <cmath>
#include <span>
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
    const ImageSet::Image* image;
    ImageWraps wraps;
    /// What lanes gather, each at its place below. Slopes are of coordinates, by cells of the page's level.
    float numbers[26];
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
    kLongest = 24,  // square of how much longer a footprint is in texels than in cells, at most
};
constexpr size_t kImagedStride = sizeof(ImagedLeaf) / sizeof(float);
static_assert(sizeof(ImagedLeaf) % sizeof(float) == 0);

/// The pixels of a tile that images are seen at, leaf by leaf; after the last one it is repeated, so that lanes are
/// full.
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

/// What the leaves of several pixels say: mostly they have one.
class LeafNumbers {
public:
    /// `number`: of each pixel's leaf, aligned.
    LeafNumbers(const ImagedLeaf* leaves, const uint32_t* number) : numbers_(leaves->numbers) {
        const LaneWords all = hn::Load(Words(), number);
        isOne_ = hn::AllTrue(Words(), hn::Eq(all, hn::Set(Words(), number[0])));
        if (isOne_)
            numbers_ = leaves[number[0]].numbers;
        else
            at_ = hn::Mul(all, hn::Set(Words(), uint32_t(kImagedStride)));
    }

    [[nodiscard]] HWY_INLINE bool isOne() const { return isOne_; }
    [[nodiscard]] HWY_INLINE Lane at(int i) const {
        return isOne_ ? Lane(numbers_[i]) : Lane(gatherFloats(numbers_ + i, at_));
    }
    [[nodiscard]] HWY_INLINE Lane2 pairAt(int i) const { return {at(i), at(i + 1)}; }
    [[nodiscard]] HWY_INLINE Lane3 vectorAt(int i) const { return {at(i), at(i + 1), at(i + 2)}; }

private:
    const float* numbers_;
    LaneWords at_ = hn::Zero(Words());
    bool isOne_;
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
    const ImagedLeaf* leaves;
    const uint32_t* leaf;                   // number of each pixel's leaf
    size_t level[kLanes];                   // number of each pixel's level
    const ImageSet::Level* same = nullptr;  // that of all; null where they have several
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
        const ImagedLeaf& leaf = read.leaves[read.leaf[i]];
        TexelQuad quad;
        if (!findTexels(leaf.image->levels[read.level[i]], leaf.wraps, {read.column[i], read.row[i]}, quad)) {
            quad = texelsAround(*leaf.image, read.level[i] + 1, leaf.wraps, {x[i], y[i]});
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

/// Sets the levels that lanes read; `finer`: numbers of the finer ones, aligned; `further`: so many after those.
HWY_INLINE void setLevels(const float* finer, size_t further, bool isOneLeaf, LevelsRead& read) {
    const bool isOne = isOneLeaf && hn::AllTrue(Floats(), load(finer) == Lane(finer[0]));
    for (int i = 0; i < kLanes; ++i) {
        if (i == 0 || !isOne) {
            const auto& levels = read.leaves[read.leaf[i]].image->levels;
            read.level[i] = std::min(size_t(finer[i]) + further, levels.size() - 1);
            const ImageSet::Level& level = levels[read.level[i]];
            read.same = i == 0 || read.same == &level ? &level : nullptr;
            read.width[i] = float(level.width);
            read.height[i] = float(level.height);
        } else {
            read.level[i] = read.level[0];
            read.width[i] = read.width[0];
            read.height[i] = read.height[0];
        }
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

/// Returns how the images are read along rays `direction`, of any length; `edge`: of a pixel, in cells of the page's
/// level.
HWY_INLINE ImagePlaces placesAlong(const LeafNumbers& leaf, Lane3 direction, Lane edge) {
    const Lane finest = leaf.at(kFinest), coarsest = leaf.at(kCoarsest);
    const Lane3 normal = leaf.vectorAt(kNormal);
    const Lane3 unit = normalize(direction);
    // From near, no footprint is longer than a texel: what imagePlaces finds then is known.
    const Lane cosine = max(abs(dot(unit, normal)), Lane(kLeastCosine));
    if (hn::AllTrue(Floats(), edge * edge * leaf.at(kLongest) < Lane(0.999f) * (cosine * cosine)))
        return {Lane(1.0f), {Lane(0.0f), Lane(0.0f)}, min(finest, coarsest)};
    const TextureSlope slope{leaf.vectorAt(kSlopeU), leaf.vectorAt(kSlopeV)};
    return imagePlaces(imageFootprint(slope, normal, unit, edge, leaf.pairAt(kSize)), finest, coarsest);
}

void filterHere(const PictureRays& rays, const PixelEdges& edges, const TileHits& hits, const ImagedLeaf* leaves,
                const ImagedPixels& pixels, uint32_t* colours) {
    const ColourTables& tables = ColourTables::get();
    const glm::vec3 first(rays.directionAt(hits.corner.x + 0.5, hits.corner.y + 0.5)), perX(rays.directionPerX),
        perY(rays.directionPerY);
    for (size_t k = 0; k < pixels.count; k += kLanes) {
        const LaneWords pixel = hn::Load(Words(), pixels.pixel + k);
        const LeafNumbers leaf(leaves, pixels.leaf + k);
        const Lane column = toFloats(hn::And(pixel, hn::Set(Words(), uint32_t(kTileWidth - 1))));
        const Lane row = toFloats(hn::ShiftRight<std::countr_zero(unsigned(kTileWidth))>(pixel));
        const Lane3 direction = mulAdd(row, spread(perY), mulAdd(column, spread(perX), spread(first)));
        const Lane edge = mulAdd(Lane(edges.perDepth), gatherFloats(hits.depth, pixel), Lane(edges.edge));
        const ImagePlaces places = placesAlong(leaf, direction, edge * leaf.at(kCells));
        const Lane b = gatherFloats(hits.x, pixel), c = gatherFloats(hits.y, pixel);
        const Lane2 at = leaf.pairAt(kPlace) + (b * leaf.pairAt(kToB) + c * leaf.pairAt(kToC));
        const Lane part = Lane(1.0f) / places.count, finer = floor(places.level), coarser = places.level - finer;
        const bool isBetween = any(coarser > Lane(0.0f));
        alignas(32) float levels[kLanes], counts[kLanes];
        store(finer, levels);
        store(places.count, counts);
        LevelsRead read[2];
        for (size_t further = 0; further < (isBetween ? 2 : 1); ++further) {
            read[further].leaves = leaves;
            read[further].leaf = pixels.leaf + k;
            setLevels(levels, further, leaf.isOne(), read[further]);
        }
        const float most = *std::max_element(counts, counts + kLanes);
        LightSum sum;
        for (float i = 0; i < most; ++i) {
            const Lane weight = select(Lane(i) < places.count, part, Lane(0.0f));
            const Lane2 place = at + (Lane(i + 0.5f) * part - Lane(0.5f)) * places.along;
            addBilinear(tables.lightOfBytes(), read[0], place, weight * (Lane(1.0f) - coarser), sum);
            if (isBetween) addBilinear(tables.lightOfBytes(), read[1], place, weight * coarser, sum);
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

/// Returns the square of the longer axis of the ellipse that a circle on a triangle is in an image, in radii. `u`, `v`:
/// how the place in the image changes on the triangle.
float longestAxisSquared(glm::vec3 u, glm::vec3 v) {
    const float uu = glm::dot(u, u), vv = glm::dot(v, v), uv = glm::dot(u, v);
    const float apart = (uu - vv) / 2;
    return (uu + vv) / 2 + std::sqrt(apart * apart + uv * uv);
}

/// Finds the triangle of a hit in its image, and appends it to `leaves`; false where the hit has none.
bool addImagedLeaf(const HostScene& scene, const HitLeaf& leaf, std::vector<ImagedLeaf>& leaves) {
    if (nodeType(leaf.node) != kNodeHard) return false;
    const HostScene::Page& page = scene.page(leaf.page);
    const auto triangle = imagedTriangle(*scene.images(), *page.view, leaf.corners);
    if (!triangle) return false;
    const auto p = cornersOf(*page.view, leaf.corners);
    const glm::vec3 n = glm::cross(p[1] - p[0], p[2] - p[0]);
    const f32::TextureSlope slope = f32::textureSlope(p[0], p[1], p[2], triangle->toB, triangle->toC);
    const glm::vec2 size(float(triangle->image->width), float(triangle->image->height));
    ImagedLeaf& found = leaves.emplace_back();
    found.image = triangle->image;
    found.wraps = triangle->wraps;
    const auto put = [&](int at, const auto& v) {
        for (int i = 0; i < v.length(); ++i) found.numbers[at + i] = v[i];
    };
    put(kPlace, triangle->place);
    put(kToB, triangle->toB);
    put(kToC, triangle->toC);
    put(kSlopeU, slope.u);
    put(kSlopeV, slope.v);
    put(kNormal, n * glm::inversesqrt(std::max(glm::dot(n, n), 1e-30f)));
    put(kSize, size);
    put(kFactor, triangle->factor);
    found.numbers[kLongest] = longestAxisSquared(size.x * slope.u, size.y * slope.v);
    found.numbers[kCells] = f32::kFootprintPixels / float(uint64_t{1} << page.cellBits);
    found.numbers[kFinest] = float(triangle->image->finest);
    found.numbers[kCoarsest] = float(triangle->image->levels.size() - 1);
    return true;
}

/// The triangles of a tile's hits in their images, each found once.
class ImagedLeaves {
public:
    ImagedLeaves(const HostScene& scene, const TileHits& hits)
        : scene_(scene), hits_(hits), numberOf_(hits.leaves.size(), kUnknown) {
        leaves_.reserve(std::min<size_t>(hits.leaves.size(), kTilePixels));
    }

    /// Returns the number of that of hits.leaves[leaf]; kWithout where it has none.
    int32_t numberOf(uint32_t leaf) {
        int32_t& number = numberOf_[leaf];
        if (number == kUnknown)
            number = addImagedLeaf(scene_, hits_.leaves[leaf], leaves_) ? int32_t(leaves_.size()) - 1 : kWithout;
        return number;
    }
    [[nodiscard]] std::span<const ImagedLeaf> all() const { return leaves_; }

    static constexpr int32_t kWithout = -1;

private:
    static constexpr int32_t kUnknown = -2;

    const HostScene& scene_;
    const TileHits& hits_;
    std::vector<int32_t> numberOf_;  // of hits.leaves
    std::vector<ImagedLeaf> leaves_;
};

/// Orders pixels by the numbers of their leaves, of which there are `leaves`, so that most lanes share one.
ImagedPixels sortedByLeaf(const ImagedPixels& pixels, size_t leaves) {
    uint32_t ends[kTilePixels + 1] = {};
    for (size_t k = 0; k < pixels.count; ++k) ++ends[pixels.leaf[k] + 1];
    for (size_t leaf = 0; leaf < leaves; ++leaf) ends[leaf + 1] += ends[leaf];
    ImagedPixels sorted;
    sorted.count = pixels.count;
    for (size_t k = 0; k < pixels.count; ++k) {
        const uint32_t at = ends[pixels.leaf[k]]++;
        sorted.pixel[at] = pixels.pixel[k];
        sorted.leaf[at] = pixels.leaf[k];
    }
    for (size_t k = sorted.count; k % 8 != 0; ++k) {
        sorted.pixel[k] = sorted.pixel[sorted.count - 1];
        sorted.leaf[k] = sorted.leaf[sorted.count - 1];
    }
    return sorted;
}

/// Calls visit(pixel) for the hits of a tile that are not on caps.
template <class Visit>
void forEachHit(const TileHits& hits, const Visit& visit) {
    for (int y = 0; y < hits.size.y; ++y)
        for (int i = y * kTileWidth; i < y * kTileWidth + hits.size.x; ++i)
            if (std::isfinite(hits.depth[i]) && !hits.onCap[size_t(i)]) visit(i);
}

}  // namespace

void findColours(const HostScene& scene, const PictureRays& rays, const PixelEdges& edges, const TileHits& hits,
                 uint32_t (&colours)[kTilePixels]) {
    if (scene.images() == nullptr) {
        forEachHit(hits, [&](int i) { colours[i] = packedColour(colourAt(scene, hits, i)); });
        return;
    }
    ImagedLeaves leaves(scene, hits);
    ImagedPixels pixels;
    forEachHit(hits, [&](int i) {
        const int32_t number = hits.blended[size_t(i)] ? ImagedLeaves::kWithout : leaves.numberOf(hits.leaf[i]);
        if (number == ImagedLeaves::kWithout) {
            colours[i] = packedColour(colourAt(scene, hits, i));
        } else {
            pixels.pixel[pixels.count] = uint32_t(i);
            pixels.leaf[pixels.count++] = uint32_t(number);
        }
    });
    if (pixels.count == 0) return;
    const ImagedPixels sorted = sortedByLeaf(pixels, leaves.all().size());
    HWY_DYNAMIC_DISPATCH(filterHere)(rays, edges, hits, leaves.all().data(), sorted, colours);
}

}  // namespace vcp
#endif
