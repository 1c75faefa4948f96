#include "builder/page/cell_overlap.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>

#include "builder/lattice/wider_clones.h"

namespace vcp {

namespace {

constexpr double kTouch = 1e-9;

}  // namespace

CellOverlap::CellOverlap(const Triangle3& t, double margin) {
    const glm::dvec3 lower = glm::min(t[0], glm::min(t[1], t[2])), upper = glm::max(t[0], glm::max(t[1], t[2]));
    nearLow_ = glm::ivec3(glm::floor(lower - margin));
    nearHigh_ = glm::ivec3(glm::floor(upper + margin));
    touchLow_ = glm::ivec3(glm::ceil(lower - 1.0 - kTouch));
    touchHigh_ = glm::ivec3(glm::floor(upper + kTouch));
    const glm::dvec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    x_[0] = normal.x, y_[0] = normal.y, z_[0] = normal.z;
    for (int i = 0; i < 3; ++i) {
        // The axes are the edge times x, y, z.
        const glm::dvec3 e = t[(i + 1) % 3] - t[i];
        y_[3 * i + 1] = e.z, z_[3 * i + 1] = -e.y;
        x_[3 * i + 2] = -e.z, z_[3 * i + 2] = e.x;
        x_[3 * i + 3] = e.y, y_[3 * i + 3] = -e.x;
    }
    for (int a = 0; a < kAxes; ++a) {
        double s[3];
        for (int i = 0; i < 3; ++i) s[i] = x_[a] * t[i].x + y_[a] * t[i].y + z_[a] * t[i].z;
        const double low = std::min(s[0], std::min(s[1], s[2])), high = std::max(s[0], std::max(s[1], s[2]));
        const double radius = std::abs(x_[a]) + std::abs(y_[a]) + std::abs(z_[a]);
        const double touch = radius * (0.5 + kTouch), near = radius * (0.5 + margin + kTouch);
        touch_.low[a] = low - touch, touch_.high[a] = high + touch;
        near_.low[a] = low - near, near_.high[a] = high + near;
    }
}

WIDER_CLONES void CellOverlap::classify(glm::ivec3 low, glm::ivec3 high, std::vector<uint8_t>& cells) const {
    const glm::ivec3 size = high - low + 1;
    cells.assign(size_t(size.x) * size.y * size.z, 0);
    uint8_t* cell = cells.data();
    const double middle = 0.5 * (low.x + high.x + 1), half = 0.5 * (size.x - 1);
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y, cell += size.x) {
            // First the row is tested as one box, then cell by cell.
            double row[kAxes];
            int64_t apart = 0;
            for (int a = 0; a < kAxes; ++a) {
                row[a] = y_[a] * (y + 0.5) + z_[a] * (z + 0.5);
                const double s = row[a] + x_[a] * middle, r = std::abs(x_[a]) * half;
                apart |= (s + r < near_.low[a] ? 1 : 0) | (s - r > near_.high[a] ? 1 : 0);
            }
            if (apart) continue;
            const bool rowTouches = y >= touchLow_.y && y <= touchHigh_.y && z >= touchLow_.z && z <= touchHigh_.z;
            for (int x = low.x; x <= high.x; ++x) {
                int64_t notNear = 0, notTouching = 0;
                for (int a = 0; a < kAxes; ++a) {
                    const double s = row[a] + x_[a] * (x + 0.5);
                    notNear |= (s < near_.low[a] ? 1 : 0) | (s > near_.high[a] ? 1 : 0);
                    notTouching |= (s < touch_.low[a] ? 1 : 0) | (s > touch_.high[a] ? 1 : 0);
                }
                if (notNear) continue;
                cell[x - low.x] =
                    rowTouches && x >= touchLow_.x && x <= touchHigh_.x && !notTouching ? kTouches : kNear;
            }
        }
}

}  // namespace vcp
