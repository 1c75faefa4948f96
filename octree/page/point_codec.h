// Codes where the vertices of a page's triangles are in images, once each: the material, where that does not follow
// from a vertex of the same triangle that is known, and the coordinates, foretold from the triangle across an edge,
// unfolded. Part of page_codec.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "octree/page/codec_page.h"
#include "octree/page/page_triangles.h"
#include "octree/page/range_coder.h"
#include "octree/surface/packing.h"
#include "octree/surface/position_map.h"

namespace vcp {

template <class Coder>
class PointCodec {
public:
    /// `points`: of the vertices of `page`; the encoder reads them, the decoder fills them.
    PointCodec(Coder& coder, const PageView& page, std::span<TexturePoint> points)
        : coder_(coder), page_(page), points_(points), done_(points.size(), 0), opposite_(points.size() * 2) {
        positions_.reserve(points.size());
        for (const glm::u32vec2& vertex : page.vertices) positions_.emplace_back(unpack21(vertex));
    }

    /// Returns false where there is no such page: vertices of a triangle have different materials, or no triangle has
    /// them.
    bool run() {
        forEachTriangle(page_, [&](const Index3& triangle) { codeTriangle(triangle); });
        return !wrong_ && used_ == points_.size();
    }

private:
    /// The lowest bits of coordinates that are zero all over the page, by material: images of few texels have many.
    struct Grid {
        uint32_t shift = 0;
        TexturePoint last;  ///< the latest vertex
    };

    void codeTriangle(const Index3& t) {
        std::array<uint32_t, 3> known{}, fresh{};
        size_t knownCount = 0, freshCount = 0;
        for (const uint32_t v : t) (done_[v] ? known[knownCount++] : fresh[freshCount++]) = v;
        if (freshCount > 0) {
            uint32_t material = knownCount > 0 ? points_[known[0]].material : points_[t[0]].material;
            if (knownCount == 0) codeMaterial(material);
            Grid* const grid = material == 0 ? nullptr : &gridOf(material);
            for (size_t i = 0; i < freshCount; ++i) {
                codeVertex(fresh[i], material, grid, known, knownCount);
                known[knownCount++] = fresh[i];
            }
        }
        if (points_[t[0]].material != points_[t[1]].material || points_[t[0]].material != points_[t[2]].material)
            wrong_ = true;
        if (points_[t[0]].material == 0) return;
        for (size_t i = 0; i < 3; ++i) opposite_.findOrAdd(edge(t[i], t[(i + 1) % 3])) = t[(i + 2) % 3];
    }

    static uint64_t edge(uint32_t a, uint32_t b) { return uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

    void codeMaterial(uint32_t& material) {
        bool same = material == lastMaterial_;
        coder_.bit(sameMaterial_, same);
        if (same)
            material = lastMaterial_;
        else
            material_.code(coder_, material);
        lastMaterial_ = material;
    }

    /// Returns the grid of a material; codes it with the first vertex.
    Grid& gridOf(uint32_t material) {
        const auto [at, isNew] = grids_.try_emplace(material);
        if (!isNew) return at->second;
        uint32_t shift = 0;
        if constexpr (Coder::kEncodes) {
            uint32_t any = 1u << kMostShift;
            for (const TexturePoint& point : points_)
                if (point.material == material) any |= uint32_t(point.u) | uint32_t(point.v);
            shift = uint32_t(std::countr_zero(any));
        }
        coder_.raw(shift, 5);
        at->second.shift = shift;
        return at->second;
    }

    void codeVertex(uint32_t v, uint32_t material, Grid* grid, const std::array<uint32_t, 3>& known,
                    size_t knownCount) {
        done_[v] = 1;
        ++used_;
        TexturePoint& point = points_[v];
        if constexpr (Coder::kEncodes) wrong_ |= point.material != material;
        point.material = material;
        if (grid == nullptr) {
            if constexpr (Coder::kEncodes) wrong_ |= point.u != 0 || point.v != 0;
            return;
        }
        size_t kind = std::min<size_t>(knownCount, 2);
        glm::dvec2 foretold = knownCount == 0 ? placeOf(grid->last) : placeOf(points_[known[0]]);
        if (knownCount == 2) {
            const uint32_t* behind = opposite_.find(edge(known[0], known[1]));
            if (behind != nullptr) {
                kind = 3;
                foretold = unfolded(known[0], known[1], *behind, v);
            } else {
                foretold = (foretold + placeOf(points_[known[1]])) / 2.0;
            }
        }
        const uint32_t shift = grid->shift;
        size_t size = 0;
        for (int axis = 0; axis < 2; ++axis) {
            int32_t& value = axis == 0 ? point.u : point.v;
            const int64_t near = rounded(foretold[axis], shift);
            int64_t more = 0;
            if constexpr (Coder::kEncodes) more = (int64_t{value} >> shift) - near;
            codeDifference(more, kind, size);
            size = std::min<size_t>(kSizes - 1, size_t(std::bit_width(uint64_t(std::abs(more)))) / 3);
            value = int32_t(uint32_t(uint64_t(near + more) << shift));
        }
        grid->last = point;
    }

    static glm::dvec2 placeOf(const TexturePoint& point) { return {double(point.u), double(point.v)}; }

    /// Returns a foretold coordinate in steps of the grid.
    static int64_t rounded(double at, uint32_t shift) {
        return int64_t(std::floor(std::clamp(std::ldexp(at, -int(shift)), -2147483648.0, 2147483647.0) + 0.5));
    }

    /// Returns where vertex `c` would be if its triangle lay in one plane with the one behind the edge from `a` to `b`,
    /// whose third vertex is `o`, and in one chart.
    [[nodiscard]] glm::dvec2 unfolded(uint32_t a, uint32_t b, uint32_t o, uint32_t c) const {
        const glm::dvec3 from(positions_[a]), along = glm::dvec3(positions_[b]) - from;
        const double square = glm::dot(along, along);
        const glm::dvec2 start = placeOf(points_[a]), step = placeOf(points_[b]) - start;
        if (!(square > 0)) return start;
        const auto split = [&](uint32_t v) {
            const glm::dvec3 d = glm::dvec3(positions_[v]) - from;
            const double part = std::clamp(glm::dot(d, along) / square, -kFar, kFar);
            const glm::dvec3 across = d - part * along;
            return std::pair(part, std::sqrt(glm::dot(across, across)));
        };
        const auto behind = split(o), beyond = split(c);
        const double turns = behind.second > 0 ? std::min(beyond.second / behind.second, kFar) : 0.0;
        return start + beyond.first * step - turns * (placeOf(points_[o]) - (start + behind.first * step));
    }

    /// Codes a difference of less than 2^34: what is large is rare.
    void codeDifference(int64_t& more, size_t kind, size_t size) {
        constexpr int64_t kLarge = 1 << 28;
        bool isLarge = more >= kLarge || more <= -kLarge;
        coder_.bit(large_, isLarge);
        if (isLarge) {
            uint32_t low = uint32_t(uint64_t(more)), high = uint32_t(uint64_t(more) >> 32);
            coder_.raw(low, 16);
            uint32_t middle = uint32_t(uint64_t(more)) >> 16;
            coder_.raw(middle, 16);
            coder_.raw(high, 16);
            more = int64_t(int16_t(high)) * (int64_t{1} << 32) + int64_t((middle & 0xffffu) << 16 | (low & 0xffffu));
            return;
        }
        int32_t small = int32_t(more);
        difference_[kind][size].code(coder_, small);
        more = small;
    }

    static constexpr uint32_t kMostShift = 20;
    static constexpr double kFar = 64;
    static constexpr size_t kSizes = 4;

    Coder& coder_;
    const PageView& page_;
    std::span<TexturePoint> points_;
    std::vector<glm::i32vec3> positions_;
    std::vector<uint8_t> done_;
    PositionMap<uint32_t> opposite_;  ///< the third vertex of the latest triangle at an edge
    std::map<uint32_t, Grid> grids_;
    size_t used_ = 0;
    bool wrong_ = false;
    uint32_t lastMaterial_ = 0;
    BitModel sameMaterial_, large_;
    NumberModel material_;
    SmallModel difference_[4][kSizes];
};

}  // namespace vcp
