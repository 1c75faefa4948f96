// The triangles of a page's hard leaves, as the encoder follows them. Part of page_codec.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/page/page_draft.h"

namespace vcp {

class MeshSource {
public:
    static constexpr uint32_t kNone = 0xffffffff;

    MeshSource() = default;
    /// The draft must outlive this.
    explicit MeshSource(const PageDraft& page);

    /// Whether a triangle names a vertex twice, or a part of its vertices have a mark.
    [[nodiscard]] bool wrong() const { return wrong_; }
    [[nodiscard]] uint32_t triangles() const { return uint32_t(vertices_.size()); }
    /// The vertices of a triangle, as the page numbers them.
    [[nodiscard]] const Index3& vertices(uint32_t triangle) const { return vertices_[triangle]; }
    /// The new number of a vertex of the page, or kNone.
    [[nodiscard]] uint32_t numberOf(uint32_t vertex) const { return newVertex_[vertex]; }
    /// The page's numbers of the vertices, in their new order.
    [[nodiscard]] const std::vector<uint32_t>& vertexOrder() const { return oldVertex_; }
    /// The new number of a triangle that has been coded.
    [[nodiscard]] uint32_t newNumber(uint32_t triangle) const { return newTriangle_[triangle]; }

    /// Returns a triangle that has not been coded, at the edge between two vertices (new numbers), or kNone.
    [[nodiscard]] uint32_t across(uint32_t from, uint32_t to) const;
    /// Returns the new number of the vertex that completes the triangle, or kNone: then takeThird() numbers it.
    uint32_t thirdVertex(uint32_t triangle, uint32_t from, uint32_t to);
    glm::i32vec3 takeThird(uint32_t number) { return take(third_, number); }
    /// Gives a vertex its number; returns its position on the lattice, from the page's lowest corner.
    glm::i32vec3 take(uint32_t vertex, uint32_t number);
    /// Returns the first triangle that has not been coded.
    uint32_t nextSeed();
    void done(uint32_t triangle, uint32_t number) { newTriangle_[triangle] = number; }

private:
    void linkVertices(uint32_t vertices);

    bool wrong_ = false;
    std::span<const glm::u32vec2> positions_;
    std::span<const Index3> vertices_;
    std::vector<uint32_t> newTriangle_, newVertex_, oldVertex_;
    std::vector<uint32_t> begin_, around_;  ///< triangles around each vertex
    uint32_t third_ = kNone, seed_ = 0;
};

}  // namespace vcp
