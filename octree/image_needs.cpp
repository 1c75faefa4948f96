#include "octree/image_needs.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <unordered_map>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "octree/page/page_triangles.h"
#include "octree/surface/image_lookup.h"

namespace vcp {

namespace {

/// Returns what a triangle of an image needs: a footprint there is at least as many texels wide as its pixel is cells,
/// times this. That is the length of the shorter axis, or the part of the longer one that is read at a time. Infinite
/// where rays cannot hit it, or find no footprint: there the coarsest level is read.
float texelsPerCell(const PageView& page, const Index3& corners, glm::vec2 size) {
    const auto p = cornersOf(page, corners);
    const TexturePoint &a = page.points[corners[0]], &b = page.points[corners[1]], &c = page.points[corners[2]];
    const auto from = [&](const TexturePoint& to) {
        return glm::vec2(float(int64_t{to.u} - a.u), float(int64_t{to.v} - a.v)) * float(kTextureUnit);
    };
    const f32::TextureSlope slope = f32::textureSlope(p[0], p[1], p[2], from(b), from(c));
    const glm::vec3 u = size.x * slope.u, v = size.y * slope.v;
    // The singular values of the two slopes.
    const float uu = glm::dot(u, u), vv = glm::dot(v, v), uv = glm::dot(u, v), mean = 0.5f * (uu + vv);
    const float apart = std::sqrt(0.25f * (uu - vv) * (uu - vv) + uv * uv);
    const float texels =
        std::max(std::sqrt(std::max(mean - apart, 0.0f)), std::sqrt(mean + apart) / float(f32::kMostFootprintPlaces));
    const bool hasArea = glm::cross(p[1] - p[0], p[2] - p[0]) != glm::vec3(0);
    return hasArea && texels >= 0 ? texels : std::numeric_limits<float>::infinity();
}

// How far from its place a footprint is read, texels of the finer of its levels: its places are seven texels apart at
// most, from first to last, or each is as long as eight; and between texels.
constexpr int kReach = 10;
constexpr uint32_t kMostBlocks = 128;

/// The blocks of an image that triangles lie in.
class Blocks {
public:
    explicit Blocks(const ImageRow& image)
        : across_(blocksAcross(image)), size_(image.width, image.height), has_(size_t{across_} * across_) {}

    /// `material`: of the three points.
    void add(const TexturePoint& a, const TexturePoint& b, const TexturePoint& c, const MaterialRow& material) {
        if (count_ == has_.size()) return;
        const auto columns = wrapped(
            range(std::min({a.u, b.u, c.u}), std::max({a.u, b.u, c.u}), size_.x, material.wrapU), material.wrapU);
        const auto rows = wrapped(range(std::min({a.v, b.v, c.v}), std::max({a.v, b.v, c.v}), size_.y, material.wrapV),
                                  material.wrapV);
        for (const uint32_t row : rows)
            for (const uint32_t column : columns) {
                const size_t at = size_t{row} * across_ + column;
                count_ += has_[at] ? 0 : 1;
                has_[at] = true;
            }
    }
    [[nodiscard]] std::vector<uint16_t> all() const {
        std::vector<uint16_t> blocks;
        for (size_t i = 0; i < has_.size(); ++i)
            if (has_[i]) blocks.push_back(uint16_t(i));
        return blocks;
    }

private:
    struct Range {
        int64_t first, last;
    };
    /// Returns the blocks from `low` to `high`, steps of a coordinate, and about them what the finest level reads.
    [[nodiscard]] Range range(int32_t low, int32_t high, uint32_t texels, ImageWrap wrap) const {
        const double reach = double(kReach) / texels;
        const auto at = [&](double place) { return int64_t(std::floor(place * double(across_))); };
        Range range{at(double(low) * kTextureUnit - reach), at(double(high) * kTextureUnit + reach)};
        if (wrap == ImageWrap::Clamp) {
            range.first = std::clamp<int64_t>(range.first, 0, across_ - 1);
            range.last = std::clamp<int64_t>(range.last, 0, across_ - 1);
        }
        // After two repetitions all were there, mirrored or not.
        const int64_t period = 2 * int64_t{across_};
        const int64_t before = int64_t(std::floor(double(range.first) / double(period))) * period;
        return {range.first - before, std::min(range.last, range.first + period - 1) - before};
    }

    /// Returns the blocks that are shown in a range, each once.
    [[nodiscard]] std::vector<uint32_t> wrapped(Range range, ImageWrap wrap) const {
        std::vector<uint32_t> blocks;
        for (int64_t at = range.first; at <= range.last; ++at)
            blocks.push_back(uint32_t(f32::wrappedTexel(int(at), int(across_), uint32_t(wrap))));
        std::sort(blocks.begin(), blocks.end());
        blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
        return blocks;
    }

    uint32_t across_;
    glm::uvec2 size_;
    std::vector<bool> has_;
    size_t count_ = 0;  // of those that are set
};

// Images of so many blocks across are needed in parts: of what is near, more is needed than of the rest of a page.
constexpr uint32_t kLargeBlocks = 8;

/// Returns a number of the triangles that are needed together: those in one of 4 x 4 x 4 parts of a page that show so
/// many texels, to a power of two.
uint64_t partOf(glm::vec3 middle, uint32_t log2Cells, float texels) {
    const glm::uvec3 part(glm::clamp(middle * std::ldexp(4.0f, -int(log2Cells)), 0.0f, 3.0f));
    const int octave = std::clamp(std::ilogb(std::max(texels, 1e-3f)), -8, 23) + 8;
    return uint64_t(octave) << 6 | part.z << 4 | part.y << 2 | part.x;
}

struct Texels {
    int64_t first, last;
};

/// Returns the texels of a row of a level that are read about a block. Blocks hold what is read of level 0; of a
/// coarser one, as many texels are, which are wider.
Texels texelsOf(uint32_t block, uint32_t across, uint32_t size, uint32_t level) {
    const int64_t reach = level == 0 ? 0 : kReach;
    const uint64_t end = (uint64_t{block} + 1) * size;
    return {int64_t(uint64_t{block} * size / across) - reach, int64_t((end + across - 1) / across) - 1 + reach};
}

/// Visits the tiles of a row of texels. Beyond an edge an image goes on from the other one; or with what is at this
/// one, which is among them.
template <class Visit>
void forEachTile(Texels texels, int64_t size, uint32_t edge, const Visit& visit) {
    if (texels.last - texels.first >= size) texels = {0, size - 1};
    for (int64_t at = texels.first; at <= texels.last;) {
        const int64_t inside = (at % size + size) % size;
        visit(uint32_t(inside / edge));
        at += std::min<int64_t>(edge - inside % edge, size - inside);
    }
}

}  // namespace

std::vector<ImageNeed> imageNeeds(const ImageTables& tables, const PageView& page) {
    std::vector<ImageNeed> needs;
    if (page.points.empty()) return needs;
    std::unordered_map<uint64_t, size_t> placeOf;  // in `needs`
    std::vector<Blocks> blocks;                    // of each of `needs`
    forEachTriangle(page, [&](const Index3& corners) {
        const uint32_t number = page.points[corners[0]].material;
        if (number == 0 || number > tables.materials.size()) return;
        const auto p = cornersOf(page, corners);
        const glm::vec3 low = glm::min(p[0], glm::min(p[1], p[2])), high = glm::max(p[0], glm::max(p[1], p[2]));
        const auto add = [&](uint32_t shown) {
            const ImageRow& image = tables.images[shown];
            const float texels = texelsPerCell(page, corners, glm::vec2(float(image.width), float(image.height)));
            const bool isLarge = blocksAcross(image) >= kLargeBlocks;
            const uint64_t part = isLarge ? partOf(0.5f * (low + high), page.header.log2Cells, texels) : 0;
            const auto [found, isNew] = placeOf.try_emplace(uint64_t{shown} << 32 | part, needs.size());
            if (isNew) {
                needs.push_back({shown, texels, {}, low, high});
                blocks.emplace_back(image);
            }
            ImageNeed& need = needs[found->second];
            need.texelsPerCell = std::min(need.texelsPerCell, texels);
            need.low = glm::min(need.low, low), need.high = glm::max(need.high, high);
            blocks[found->second].add(page.points[corners[0]], page.points[corners[1]], page.points[corners[2]],
                                      tables.materials[number - 1]);
        };
        forEachImage(tables, number - 1, add);
    });
    for (size_t i = 0; i < needs.size(); ++i) needs[i].blocks = blocks[i].all();
    return needs;
}

double levelNeeded(float texelsPerCell, double pixelEdge, uint32_t levels) {
    // Single precision may find a footprint a little shorter.
    constexpr double kRounding = 0.999;
    // Where a pixel is narrower, by how much does not matter.
    constexpr double kFewestTexels = 0x1p-16;
    const double texels = double(texelsPerCell) * pixelEdge * double(f32::kFootprintPixels) * kRounding;
    return std::min(std::log2(texels > kFewestTexels ? texels : kFewestTexels), double(levels - 1));
}

uint32_t blocksAcross(const ImageRow& image) {
    return std::clamp(std::bit_floor(std::max(image.width, image.height) / kFirstEdge), 1u, kMostBlocks);
}

std::vector<uint32_t> piecesNeeded(const ImagePieces& pieces, const ImageNeed& need, uint32_t level) {
    const ImageLevel& of = pieces.levelsOf(need.image)[level];
    const uint32_t across = blocksAcross(pieces.tables().images[need.image]);
    std::vector<uint32_t> needed;
    for (const uint16_t block : need.blocks)
        forEachTile(texelsOf(block / across, across, of.height, level), of.height, of.tileEdge, [&](uint32_t row) {
            forEachTile(texelsOf(block % across, across, of.width, level), of.width, of.tileEdge, [&](uint32_t column) {
                const auto piece = uint32_t(pieces.pieceOf(need.image, level, {column, row}));
                if (needed.empty() || needed.back() != piece) needed.push_back(piece);
            });
        });
    std::sort(needed.begin(), needed.end());
    needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
    return needed;
}

}  // namespace vcp
