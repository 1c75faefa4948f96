#include "octree/page/mesh_source.h"

#include <utility>

#include "octree/surface/packing.h"

namespace vcp {

MeshSource::MeshSource(const PageDraft& page)
    : positions_(page.vertices),
      vertices_(page.triangles),
      newTriangle_(page.triangles.size(), kNone),
      newVertex_(page.vertices.size(), kNone) {
    const auto isOpen = [&](uint32_t vertex) { return isOpenVertex(positions_[vertex]); };
    for (const auto& [a, b, c] : vertices_)
        if (a == b || b == c || c == a || isOpen(a) != isOpen(b) || isOpen(b) != isOpen(c)) wrong_ = true;
    oldVertex_.reserve(page.vertices.size());
    linkVertices(uint32_t(page.vertices.size()));
}

void MeshSource::linkVertices(uint32_t vertices) {
    begin_.assign(size_t{vertices} + 1, 0);
    for (const Index3& t : vertices_)
        for (const uint32_t v : t) ++begin_[v + 1];
    for (uint32_t v = 0; v < vertices; ++v) begin_[v + 1] += begin_[v];
    around_.resize(vertices_.size() * 3);
    std::vector<uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (uint32_t k = 0; k < vertices_.size(); ++k)
        for (const uint32_t v : vertices_[k]) around_[next[v]++] = k;
}

uint32_t MeshSource::across(uint32_t from, uint32_t to) const {
    // From the end with fewer triangles around it: the tip of a fan has very many.
    uint32_t a = oldVertex_[from], b = oldVertex_[to];
    if (begin_[a + 1] - begin_[a] > begin_[b + 1] - begin_[b]) std::swap(a, b);
    for (uint32_t i = begin_[a]; i < begin_[a + 1]; ++i) {
        const uint32_t k = around_[i];
        const Index3& t = vertices_[k];
        if (newTriangle_[k] == kNone && (t[0] == b || t[1] == b || t[2] == b)) return k;
    }
    return kNone;
}

uint32_t MeshSource::thirdVertex(uint32_t triangle, uint32_t from, uint32_t to) {
    const uint32_t a = oldVertex_[from], b = oldVertex_[to];
    for (const uint32_t v : vertices_[triangle])
        if (v != a && v != b) third_ = v;
    return newVertex_[third_];
}

glm::i32vec3 MeshSource::take(uint32_t vertex, uint32_t number) {
    newVertex_[vertex] = number;
    oldVertex_.push_back(vertex);
    return glm::i32vec3(unpack21(positions_[vertex])) - kLatticeBias;
}

uint32_t MeshSource::nextSeed() {
    while (newTriangle_[seed_] != kNone) ++seed_;
    return seed_;
}

}  // namespace vcp
