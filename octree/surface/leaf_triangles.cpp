#include "octree/surface/leaf_triangles.h"

#include <glm/common.hpp>

namespace vcp {

namespace {

template <class Vector>
auto sumOfSizes(const Vector& v) {
    const auto size = [](auto x) { return x < 0 ? -x : x; };
    return size(v.x) + size(v.y) + size(v.z);
}

}  // namespace

void CubeTest::prepare() {
    std::array<glm::i64vec3, 3> e;
    for (size_t i = 0; i < 3; ++i) e[i] = glm::i64vec3(corners_[(i + 1) % 3] - corners_[i]);
    normal_ = {e[0].y * e[1].z - e[0].z * e[1].y, e[0].z * e[1].x - e[0].x * e[1].z, e[0].x * e[1].y - e[0].y * e[1].x};
    normalSize_ = sumOfSizes(normal_);
    offset_ = normal_.x * corners_[0].x + normal_.y * corners_[0].y + normal_.z * corners_[0].z;
    int n = 0;
    for (size_t i = 0; i < 3; ++i) {
        const glm::dvec3 d(e[i]), a(corners_[i]), c(corners_[(i + 2) % 3]);
        // Both ends of the edge itself project to the same point.
        const auto set = [&](double x, double y, double z) {
            const double pa = 2 * (x * a.x + y * a.y + z * a.z), pc = 2 * (x * c.x + y * c.y + z * c.z);
            along_[0][n] = x;
            along_[1][n] = y;
            along_[2][n] = z;
            least_[n] = std::min(pa, pc);
            most_[n] = std::max(pa, pc);
            size_[n++] = std::abs(x) + std::abs(y) + std::abs(z);
        };
        set(0, d.z, -d.y);
        set(-d.z, 0, d.x);
        set(d.y, -d.x, 0);
    }
    prepared_ = true;
}

bool CubeTest::touches(glm::i32vec3 lower, int edge) {
    for (const glm::i32vec3& p : corners_) {
        const glm::i32vec3 d = p - lower;
        if (std::min(d.x, std::min(d.y, d.z)) >= 0 && std::max(d.x, std::max(d.y, d.z)) <= edge) return true;
    }
    if (!prepared_) prepare();
    // All values are doubled, so that the cube's centre is whole.
    const int64_t cx = 2 * int64_t{lower.x} + edge, cy = 2 * int64_t{lower.y} + edge, cz = 2 * int64_t{lower.z} + edge;
    const int64_t plane = 2 * offset_ - (normal_.x * cx + normal_.y * cy + normal_.z * cz);
    if ((plane < 0 ? -plane : plane) > edge * normalSize_) return false;
    const double x = double(cx), y = double(cy), z = double(cz), half = edge;
    // The cube is apart where any of the differences is negative: its sign says so without a branch. Half a step of
    // room, so that none is zero: zeros have either sign.
    int64_t apart = 0;
    for (int n = 0; n < kAxes; ++n) {
        const double centre = along_[0][n] * x + along_[1][n] * y + along_[2][n] * z, reach = half * size_[n] + 0.5;
        apart |= std::bit_cast<int64_t>(centre + reach - least_[n]) | std::bit_cast<int64_t>(most_[n] + reach - centre);
    }
    return apart >= 0;
}

uint32_t CubeTest::touchedOctants(glm::i32vec3 middle, int half, uint32_t among) {
    uint32_t touched = 0;
    for (const glm::i32vec3& p : corners_) {
        const glm::i32vec3 d = glm::abs(p - middle);
        touched |= uint32_t{std::max(d.x, std::max(d.y, d.z)) <= half} * octantsTouched(p, p, middle);
    }
    uint32_t rest = among & ~touched;
    if (rest == 0) return touched;
    if (!prepared_) prepare();
    // As in touches(), of all octants at once: their centres, doubled, are `half` away from twice the middle.
    const glm::i64vec3 centre = glm::i64vec3(middle) * int64_t{2};
    const int64_t plane = 2 * offset_ - (normal_.x * centre.x + normal_.y * centre.y + normal_.z * centre.z);
    const glm::i64vec3 ways = int64_t{half} * normal_;
    const double x = double(centre.x), y = double(centre.y), z = double(centre.z), h = half;
    double least[kAxes], most[kAxes], away[3][kAxes];
    for (int n = 0; n < kAxes; ++n) {
        const double at = along_[0][n] * x + along_[1][n] * y + along_[2][n] * z, reach = h * size_[n] + 0.5;
        least[n] = least_[n] - at - reach;
        most[n] = most_[n] - at + reach;
        for (int axis = 0; axis < 3; ++axis) away[axis][n] = h * along_[axis][n];
    }
    for (; rest != 0; rest &= rest - 1) {
        const int o = std::countr_zero(rest);
        const int64_t sx = o & 1 ? 1 : -1, sy = o & 2 ? 1 : -1, sz = o & 4 ? 1 : -1;
        const int64_t above = plane - (sx * ways.x + sy * ways.y + sz * ways.z);
        if ((above < 0 ? -above : above) > half * normalSize_) continue;
        const double dx = double(sx), dy = double(sy), dz = double(sz);
        int64_t apart = 0;
        for (int n = 0; n < kAxes; ++n) {
            const double to = dx * away[0][n] + dy * away[1][n] + dz * away[2][n];
            apart |= std::bit_cast<int64_t>(to - least[n]) | std::bit_cast<int64_t>(most[n] - to);
        }
        if (apart >= 0) touched |= 1u << o;
    }
    return touched;
}

NodePlaces::NodePlaces(uint32_t root, std::span<const uint32_t> nodes, uint32_t log2Cells)
    : nodes_(nodes),
      cells_(1 << log2Cells),
      log2Cells_(int(log2Cells)),
      word_(size_t{1} << (3 * log2Cells), kNodeEmpty << kNodeTypeShift),
      size_(word_.size()) {
    fillCells(root, glm::i32vec3(0), log2Cells);
}

void NodePlaces::fillCells(uint32_t word, glm::i32vec3 lower, uint32_t log2Edge) {
    const int edge = 1 << log2Edge;
    if (nodeType(word) == kNodeInternal && log2Edge > 0) {
        const uint32_t* child = &nodes_[size_t{8} * (word & kNodePayloadMask)];
        for (int o = 0; o < 8; ++o)
            if (nodeType(child[o]) != kNodeEmpty)
                fillCells(child[o], lower + edge / 2 * glm::i32vec3(o & 1, o >> 1 & 1, o >> 2), log2Edge - 1);
        return;
    }
    for (int z = lower.z; z < lower.z + edge; ++z)
        for (int y = lower.y; y < lower.y + edge; ++y) {
            size_t i = cell(lower.x, y, z);
            for (int x = 0; x < edge; ++x, ++i) {
                word_[i] = word;
                size_[i] = uint8_t(log2Edge);
            }
        }
}

uint64_t NodePlaces::nodesIn(uint32_t word) const {
    uint64_t nodes = 1;
    if (nodeType(word) == kNodeInternal)
        for (const uint32_t child : nodes_.subspan(size_t{8} * (word & kNodePayloadMask), 8)) nodes += nodesIn(child);
    return nodes;
}

uint64_t NodePlaces::mostNodesInCell() const {
    uint64_t most = 0;
    for (const uint32_t word : word_)
        if (nodeType(word) == kNodeInternal) most = std::max(most, nodesIn(word));
    return most;
}

uint32_t NodePlaces::typeAt(glm::i32vec3 p) const {
    const glm::i32vec3 c = p >> kCellShift;
    if (std::min(c.x, std::min(c.y, c.z)) < 0 || std::max(c.x, std::max(c.y, c.z)) >= cells_) return kNodeEmpty;
    uint32_t word = word_[cell(c.x, c.y, c.z)];
    for (int half = kLatticePerCell / 2; nodeType(word) == kNodeInternal; half /= 2) {
        const uint32_t octant = (p.x & half ? 1u : 0u) | (p.y & half ? 2u : 0u) | (p.z & half ? 4u : 0u);
        word = nodes_[size_t{8} * (word & kNodePayloadMask) + octant];
    }
    return nodeType(word);
}

}  // namespace vcp
