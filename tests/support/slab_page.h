// Pages of slab leaves around the surface of a signed distance, for tests that must not depend on the builder.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "octree/page/page.h"
#include "octree/surface/packing.h"
#include "tests/support/signed_distance.h"

namespace vcp::test {

/// Builds one page; every cell that the surface may touch is a slab leaf, everything else is empty. The slab holds the
/// surface's points on a grid of `kGrid`^3 lines, and the bound on what is between them.
class SlabPageBuilder {
public:
    SlabPageBuilder(const SignedDistanceField& field, glm::dvec3 origin, double cell, uint32_t log2Cells,
                    float certifiedErrorCells)
        : field_(field), origin_(origin), cell_(cell) {
        header_.log2Cells = log2Cells;
        header_.certifiedError = certifiedErrorCells;
    }

    std::vector<uint4> build() {
        // Breadth first, as the builder's pages and the codec's.
        std::vector<Box> queue;
        header_.root = node({glm::ivec3(0), 1 << header_.log2Cells}, queue);
        for (size_t i = 0; i < queue.size(); ++i)
            for (int o = 0; o < 8; ++o) {
                const int half = queue[i].edge / 2;
                nodes_.push_back(node({queue[i].lowest + half * glm::ivec3(o & 1, o >> 1 & 1, o >> 2), half}, queue));
            }
        header_.groups = uint32_t(nodes_.size() / 8);
        header_.slabLeaves = uint32_t(vectors_.size());
        header_.faces = (header_.slabLeaves + 3) / 4;
        const PageSections s = pageSections(header_);
        std::vector<uint4> page(s.end / 16);
        auto* out = reinterpret_cast<std::byte*>(page.data());
        std::memcpy(out, &header_, sizeof header_);
        if (!nodes_.empty()) std::memcpy(out + s.nodes, nodes_.data(), nodes_.size() * 4);
        if (!vectors_.empty()) std::memcpy(out + s.faces, vectors_.data(), vectors_.size() * 4);
        return page;
    }

private:
    struct Box {
        glm::ivec3 lowest;
        int edge;
    };
    struct Slab {
        double first = 1, last = -1;  ///< along the direction, from the leaf's centre, leaf edges
        uint32_t octants = 0;
    };
    static constexpr int kGrid = 8;  ///< lines of a leaf's grid, along each axis

    uint32_t node(Box box, std::vector<Box>& queue) {
        const glm::dvec3 centre = origin_ + (glm::dvec3(box.lowest) + 0.5 * box.edge) * cell_;
        const SignedDistance at = field_(centre);
        const double clear = std::abs(at.distance) / cell_ - 0.5 * box.edge * std::sqrt(3.0) - 1e-9;
        // The grown box must fit into the ball around the centre: its corners move by sqrt(3) times its faces.
        if (clear > 0) return emptyNode(std::max(0.0, clear / std::sqrt(3.0) - 0.01));
        if (box.edge > 1) {
            queue.push_back(box);
            return kNodeInternal << kNodeTypeShift | uint32_t(queue.size() - 1);
        }
        const uint32_t direction = packSlabDirection(at.outward);
        const Slab slab = slabAround(box, f64::decodeDirection(direction));
        if (slab.octants == 0) return emptyNode(0);
        vectors_.push_back(packSlab(direction, slab.first, slab.last));
        return slabNode(slab.octants, uint32_t(vectors_.size() - 1));
    }

    /// Sees, for each small cube of the leaf, whether the surface may be in it, and how far it may reach.
    [[nodiscard]] Slab slabAround(Box box, glm::dvec3 n) const {
        Slab slab;
        const double half = 0.5 / kGrid;
        for (int z = 0; z < kGrid; ++z)
            for (int y = 0; y < kGrid; ++y)
                for (int x = 0; x < kGrid; ++x) {
                    const glm::dvec3 at = (glm::dvec3(x, y, z) + 0.5) / double(kGrid);
                    const SignedDistance s = field_(origin_ + (glm::dvec3(box.lowest) + at) * cell_);
                    const double distance = s.distance / cell_;
                    if (std::abs(distance) > half * std::sqrt(3.0)) continue;
                    // The surface in the small cube is near the tangent plane; both are seen along n.
                    const double middle = glm::dot(n, at - 0.5 - distance * s.outward);
                    const double reach = half * std::sqrt(3.0) * glm::length(glm::cross(n, s.outward)) + 0.02;
                    slab.first = std::min(slab.first, middle - reach);
                    slab.last = std::max(slab.last, middle + reach);
                    slab.octants |= 1u << (x * 2 / kGrid + 2 * (y * 2 / kGrid) + 4 * (z * 2 / kGrid));
                }
        return slab;
    }

    const SignedDistanceField& field_;
    glm::dvec3 origin_;
    double cell_;
    PageHeader header_;
    std::vector<uint32_t> nodes_, vectors_;
};

}  // namespace vcp::test
