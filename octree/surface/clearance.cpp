#include "octree/surface/clearance.h"

namespace vcp {

Clearance::Clearance(int cells) : cells_(cells), side_(cells + 2) { grown_.emplace_back(size_t(side_) * side_, 0); }

void Clearance::occupy(glm::ivec3 lower, int edge) {
    const uint64_t bits = columns(lower.x, edge);
    for (int z = lower.z; z < lower.z + edge; ++z)
        for (int y = lower.y; y < lower.y + edge; ++y) grown_[0][row(y, z)] |= bits;
}

int Clearance::of(glm::ivec3 lower, int edge) {
    for (int radius = 1; radius <= cells_; ++radius) {
        if (int(grown_.size()) <= radius) grow();
        if (meets(grown_[size_t(radius)], lower, edge)) return radius - 1;
    }
    return cells_;
}

bool Clearance::meets(const std::vector<uint64_t>& rows, glm::ivec3 lower, int edge) const {
    const uint64_t bits = columns(lower.x, edge);
    for (int z = lower.z; z < lower.z + edge; ++z)
        for (int y = lower.y; y < lower.y + edge; ++y)
            if (rows[row(y, z)] & bits) return true;
    return false;
}

/// One more ring of neighbours around the occupied cells: along x, then y, then z.
void Clearance::grow() {
    const std::vector<uint64_t>& in = grown_.back();
    const uint64_t all = columns(0, cells_);
    std::vector<uint64_t> wide(in.size(), 0), out(in.size(), 0);
    const size_t side = size_t(side_);
    for (size_t i = 1; i + 1 < in.size(); ++i) {
        const uint64_t column = in[i - 1] | in[i] | in[i + 1];
        wide[i] = (column | column << 1 | column >> 1) & all;
    }
    for (int z = 0; z < cells_; ++z)
        for (size_t i = row(0, z); i < row(cells_, z); ++i) out[i] = wide[i - side] | wide[i] | wide[i + side];
    grown_.push_back(std::move(out));
}

}  // namespace vcp
