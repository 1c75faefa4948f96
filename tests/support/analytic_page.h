// Pages made from a formula, for tests that must not depend on the builder: every cell that a signed distance
// function passes through is a soft leaf or a slab leaf, everything else is empty with an honest clearance.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>
#include <vector>

#include "octree/page/page.h"
#include "octree/page_reader.h"
#include "octree/surface/morton.h"
#include "octree/surface/packing.h"
#include "tests/support/signed_distance.h"
#include "tests/support/slab_page.h"

namespace vcp::test {

struct AnalyticPage {
    PageBytes bytes;
    uint32_t softLeaves = 0, slabLeaves = 0;
};

// Builds one page; `axis` is the axis along which its leaves share faces.
class AnalyticPageBuilder {
public:
    AnalyticPageBuilder(const SignedDistanceField& field, glm::dvec3 origin, double cell, uint32_t log2Cells,
                        uint32_t axis, float certifiedErrorCells, uint32_t wallCode)
        : field_(field), origin_(origin), cell_(cell), axis_(axis), wallCode_(wallCode) {
        header_.log2Cells = log2Cells;
        header_.certifiedError = certifiedErrorCells;
    }

    AnalyticPage build() {
        collectLeaves(glm::ivec3(0), 1 << header_.log2Cells);
        layFaces();
        header_.root = node(glm::ivec3(0), 1 << header_.log2Cells);
        header_.groups = uint32_t(nodes_.size() / 8);
        header_.faces = uint32_t(faces_.size());
        header_.softLeaves = uint32_t(leaves_.size());
        const PageSections s = pageSections(header_);
        AnalyticPage page;
        page.softLeaves = header_.softLeaves;
        page.bytes.geometry.resize(s.end / 16);
        auto* out = reinterpret_cast<std::byte*>(page.bytes.geometry.data());
        std::memcpy(out, &header_, sizeof(header_));
        if (!nodes_.empty()) std::memcpy(out + s.nodes, nodes_.data(), nodes_.size() * 4);
        if (!faces_.empty()) std::memcpy(out + s.faces, faces_.data(), faces_.size() * 16);
        return page;
    }

private:
    /// Distance from a box's centre to the surface beyond the box's half diagonal, in cells; below 0: perhaps inside.
    double clearance(glm::ivec3 lowest, int edge) const {
        const glm::dvec3 centre = origin_ + (glm::dvec3(lowest) + 0.5 * edge) * cell_;
        return std::abs(field_(centre).distance) / cell_ - 0.5 * edge * std::sqrt(3.0) - 1e-9;
    }

    void collectLeaves(glm::ivec3 lowest, int edge) {
        if (clearance(lowest, edge) > 0) return;
        if (edge == 1) {
            const std::array<int, 3> key = {lowest[(axis_ + 2) % 3], lowest[(axis_ + 1) % 3], lowest[axis_]};
            leaves_[key] = 0;
            return;
        }
        for (int o = 0; o < 8; ++o)
            collectLeaves(lowest + glm::ivec3(o & 1, o >> 1 & 1, o >> 2) * (edge / 2), edge / 2);
    }

    /// Leaves in runs along the axis; a run of n leaves has n + 1 faces.
    void layFaces() {
        std::array<int, 3> last = {-1, -1, -2};
        for (auto& [key, face] : leaves_) {
            const bool continues = key[0] == last[0] && key[1] == last[1] && key[2] == last[2] + 1;
            if (!continues) faces_.push_back(faceAt(key));
            face = uint32_t(faces_.size() - 1);
            faces_.push_back(faceAt({key[0], key[1], key[2] + 1}));
            last = key;
        }
    }

    uint4 faceAt(std::array<int, 3> key) const {
        uint4 face;
        for (int c = 0; c < 4; ++c) {
            glm::dvec3 corner;
            corner[axis_] = key[2];
            corner[(axis_ + 1) % 3] = key[1] + (c & 1);
            corner[(axis_ + 2) % 3] = key[0] + (c >> 1);
            const SignedDistance s = field_(origin_ + corner * cell_);
            const bool inside = s.distance < 0;
            face[c] = packVector(std::abs(s.distance) / cell_, inside ? -s.outward : s.outward, inside);
        }
        return face;
    }

    uint32_t node(glm::ivec3 lowest, int edge) {
        const double clear = clearance(lowest, edge);
        // The grown box must fit into the ball around the centre: its corners move by sqrt(3) times its faces.
        if (clear > 0) return emptyNode(std::max(0.0, clear / std::sqrt(3.0) - 0.01));
        if (edge == 1) {
            const uint32_t face = leaves_.at({lowest[(axis_ + 2) % 3], lowest[(axis_ + 1) % 3], lowest[axis_]});
            return kNodeSoft << kNodeTypeShift | face | axis_ << kSoftAxisShift | wallCode_ << kSoftWallShift |
                   3u << kSoftDipShift;
        }
        const size_t group = nodes_.size() / 8;
        nodes_.resize(nodes_.size() + 8);
        for (int o = 0; o < 8; ++o)
            nodes_[8 * group + o] = node(lowest + glm::ivec3(o & 1, o >> 1 & 1, o >> 2) * (edge / 2), edge / 2);
        return uint32_t(group);
    }

    const SignedDistanceField& field_;
    glm::dvec3 origin_;
    double cell_;
    uint32_t axis_, wallCode_;
    PageHeader header_;
    std::map<std::array<int, 3>, uint32_t> leaves_;  ///< to their first face
    std::vector<uint4> faces_;
    std::vector<uint32_t> nodes_;
};

struct AnalyticOptions {
    glm::dvec3 origin{0};   ///< of the root page, world
    double finestCell = 1;  ///< world
    uint32_t levels = 1;
    uint32_t log2Cells = 4;
    uint32_t axis = 0;
    uint32_t wallCode = 1;
    double errorCells = 0.05;  ///< certified error of every page, in its cells
    uint32_t slabLevels = 0;   ///< so many of the coarsest levels have slab leaves, the others soft leaves
};

struct AnalyticDataset {
    Dataset dataset;
    std::vector<PageBytes> pages;
};

/// A dataset of `levels` levels; pages without a leaf are left out.
inline AnalyticDataset analyticDataset(const SignedDistanceField& field, const AnalyticOptions& o) {
    AnalyticDataset result;
    FileHeader& h = result.dataset.header;
    for (int i = 0; i < 3; ++i) {
        h.origin[i] = h.boundsMin[i] = o.origin[i];
        h.boundsMax[i] = o.origin[i] + o.finestCell * std::exp2(double(o.log2Cells + o.levels - 1));
    }
    h.cell = o.finestCell;
    h.levels = o.levels;
    h.log2Cells = o.log2Cells;
    const auto makePage = [&](uint32_t level, glm::u32vec3 at, AnalyticPage& page) {
        const double cell = o.finestCell * std::exp2(double(o.levels - 1 - level));
        const glm::dvec3 origin = o.origin + glm::dvec3(at) * cell * std::exp2(double(o.log2Cells));
        if (level < o.slabLevels) {
            page.bytes.geometry = SlabPageBuilder(field, origin, cell, o.log2Cells, float(o.errorCells)).build();
            page.slabLeaves = parsePage(page.bytes.geometryBytes())->header.slabLeaves;
            return page.slabLeaves > 0;
        }
        page = AnalyticPageBuilder(field, origin, cell, o.log2Cells, o.axis, float(o.errorCells), o.wallCode).build();
        return page.softLeaves > 0;
    };
    const auto add = [&](uint32_t level, glm::u32vec3 at, AnalyticPage page) {
        PageEntry entry;
        entry.morton = mortonEncode(at);
        entry.level = uint8_t(level);
        entry.leaves = page.softLeaves + page.slabLeaves;
        entry.slabLeaves = page.slabLeaves & 0xffffffu;
        entry.pageBytes = uint32_t(page.bytes.geometryBytes().size());
        entry.certifiedError = float(o.errorCells * o.finestCell * std::exp2(double(o.levels - 1 - level)) * 1.0000002);
        result.dataset.pages.push_back(entry);
        result.pages.push_back(std::move(page.bytes));
        ++h.level[level].pages;
    };
    AnalyticPage page;
    makePage(0, glm::u32vec3(0), page);
    add(0, glm::u32vec3(0), std::move(page));
    size_t first = 0;
    for (uint32_t level = 1; level < o.levels; ++level) {
        const size_t end = result.dataset.pages.size();
        h.level[level].firstEntry = end;
        for (size_t parent = first; parent < end; ++parent) {
            const glm::u32vec3 at = mortonDecode(result.dataset.pages[parent].morton);
            result.dataset.pages[parent].firstChild = uint32_t(result.dataset.pages.size());
            for (uint32_t octant = 0; octant < 8; ++octant) {
                const glm::u32vec3 child = at * 2u + glm::u32vec3(octant & 1, octant >> 1 & 1, octant >> 2);
                AnalyticPage childPage;
                if (!makePage(level, child, childPage)) continue;
                result.dataset.pages[parent].childMask |= uint8_t(1u << octant);
                add(level, child, std::move(childPage));
            }
        }
        first = end;
    }
    h.pages = result.dataset.pages.size();
    for (size_t i = 0; i < result.dataset.pages.size(); ++i) {
        PageEntry& entry = result.dataset.pages[i];
        if (entry.childMask == 0) entry.firstChild = 0;
        double& error = h.level[entry.level].certifiedError;
        error = std::max(error, double(entry.certifiedError));
        if (entry.level + 1u == o.levels) h.leaves += entry.leaves;
    }
    h.certifiedErrorMax = h.level[o.levels - 1].certifiedError;
    return result;
}

}  // namespace vcp::test
