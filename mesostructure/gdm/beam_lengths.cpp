#include "mesostructure/gdm/beam_lengths.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vcp::meso {

namespace {

using std::numbers::pi;

int wrappedInto(int i, int n) { return (i % n + n) % n; }

/// Returns the ends of an interval of angles and the multiples of a right angle in it, at which slopes may turn.
std::vector<double> turningPoints(const double (&interval)[2]) {
    std::vector<double> angles{interval[0], interval[1]};
    for (int quarter = -2; quarter <= 6; ++quarter)
        if (const double angle = quarter * pi / 2; angle > interval[0] && angle < interval[1]) angles.push_back(angle);
    return angles;
}

/// The slopes of a beam along its major axis, in cells.
struct Slopes {
    int major = 0, sign = 1;
    double most = 0;  ///< greatest component of a unit direction along the major axis
    glm::dvec3 least{0}, greatest{0};
};

Slopes slopesOf(const Beam& beam, glm::dvec3 cell) {
    std::vector<glm::dvec3> directions;
    for (const double azimuth : turningPoints(beam.azimuth))
        for (double elevation : turningPoints(beam.elevation)) {
            elevation = std::clamp(elevation, -pi / 2, pi / 2);
            directions.emplace_back(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                                    std::sin(elevation));
        }
    Slopes slopes;
    double best = -1;
    for (int axis = 0; axis < 3; ++axis) {
        double least = 1e9, greatest = -1e9;
        for (const glm::dvec3& d : directions) least = std::min(least, d[axis]), greatest = std::max(greatest, d[axis]);
        const double worst = least > 0 ? least : greatest < 0 ? -greatest : 0;
        if (worst / cell[axis] <= best) continue;
        best = worst / cell[axis];
        slopes.major = axis, slopes.sign = greatest > 0 ? 1 : -1;
        slopes.most = std::max(-least, greatest) * (1 + 1e-6);
    }
    slopes.least = glm::dvec3(1e9), slopes.greatest = glm::dvec3(-1e9);
    for (const glm::dvec3& d : directions)
        for (int axis = 0; axis < 3; ++axis) {
            const double slope = d[axis] / cell[axis] / (std::abs(d[slopes.major]) / cell[slopes.major]);
            slopes.least[axis] = std::min(slopes.least[axis], slope - 1e-9);
            slopes.greatest[axis] = std::max(slopes.greatest[axis], slope + 1e-9);
        }
    return slopes;
}

}  // namespace

Beam beamOf(int azimuths, int elevations, int azimuth, int elevation, double slack) {
    const double wedge = 2 * pi / azimuths, band = pi / elevations;
    return {{azimuth * wedge - slack, (azimuth + 1) * wedge + slack},
            {-pi / 2 + elevation * band - slack, -pi / 2 + (elevation + 1) * band + slack}};
}

BeamGrid::BeamGrid(glm::ivec3 cells, glm::dvec3 cell, std::span<const uint8_t> occupied, double open)
    : cells_(cells), cell_(cell), occupied_(occupied.begin(), occupied.end()), open_(open) {
    for (int major = 0; major < 3; ++major) {
        Layers& layers = layers_[size_t(major)];
        layers.a = major == 0 ? 1 : 0, layers.b = major == 2 ? 1 : 2;
        // A rectangle that reaches over the tile's border is one in two tiles side by side.
        const int na = 2 * cells[layers.a], nb = layers.b == 2 ? cells.z : 2 * cells[layers.b];
        layers.acrossA = size_t(na) + 1;
        layers.size = layers.acrossA * (size_t(nb) + 1);
        layers.sums.assign(layers.size * size_t(cells[major]), 0);
        for (int layer = 0; layer < cells[major]; ++layer) {
            uint32_t* sums = layers.sums.data() + layers.size * size_t(layer);
            for (int b = 0; b < nb; ++b)
                for (int a = 0; a < na; ++a) {
                    glm::ivec3 at(0);
                    at[major] = layer, at[layers.a] = a, at[layers.b] = b;
                    const size_t here = layers.acrossA * (size_t(b) + 1) + size_t(a) + 1;
                    sums[here] = uint32_t(isOccupied(at)) + sums[here - 1] + sums[here - layers.acrossA] -
                                 sums[here - layers.acrossA - 1];
                }
        }
    }
}

bool BeamGrid::isOccupied(glm::ivec3 at) const {
    return occupied_[size_t(wrappedInto(at.x, cells_.x)) +
                     size_t(cells_.x) * (size_t(wrappedInto(at.y, cells_.y)) + size_t(cells_.y) * size_t(at.z))] != 0;
}

bool BeamGrid::isEmpty(int major, int layer, int a0, int a1, int b0, int b1) const {
    const Layers& layers = layers_[size_t(major)];
    const auto intoTile = [](int& from, int& to, int n) {
        const int width = std::min(to - from, n);
        from = width == n ? 0 : wrappedInto(from, n);
        to = from + width;
    };
    intoTile(a0, a1, cells_[layers.a]);
    if (layers.b == 2)
        b0 = std::max(b0, 0), b1 = std::min(b1, cells_.z);
    else
        intoTile(b0, b1, cells_[layers.b]);
    if (b0 >= b1) return true;
    const uint32_t* sums = layers.sums.data() + layers.size * size_t(layer);
    const auto at = [&](int a, int b) { return sums[layers.acrossA * size_t(b) + size_t(a)]; };
    return at(a1, b1) - at(a0, b1) - at(a1, b0) + at(a0, b0) == 0;
}

void BeamGrid::lengths(const Beam& beam, double cap, std::span<float> lengths) const {
    const Slopes slopes = slopesOf(beam, cell_);
    const int major = slopes.major, a = layers_[size_t(major)].a, b = layers_[size_t(major)].b;
    const double perLayer = cell_[major] / slopes.most;
    const int most = int(cap / perLayer) + 2;
    // The cells that rays may be in, layer by layer, from the first cell's own.
    struct Rectangle {
        int a0, a1, b0, b1;
    };
    std::vector<Rectangle> rectangles;
    for (int j = 0; j <= most; ++j) {
        const double near = std::max(0, j - 1), far = j + 1;
        const auto from = [&](int axis) {
            return int(std::floor(std::min(slopes.least[axis] * near, slopes.least[axis] * far) + open_));
        };
        const auto to = [&](int axis) {
            return int(std::ceil(1 + std::max(slopes.greatest[axis] * near, slopes.greatest[axis] * far) - open_));
        };
        rectangles.push_back({from(a), to(a), from(b), to(b)});
    }
    size_t i = 0;
    for (int z = 0; z < cells_.z; ++z)
        for (int y = 0; y < cells_.y; ++y)
            for (int x = 0; x < cells_.x; ++x, ++i) {
                const glm::ivec3 at(x, y, z);
                double length = occupied_[i] != 0 ? 0 : cap;
                for (int j = 0; j <= most && length > 0; ++j) {
                    int layer = at[major] + slopes.sign * j;
                    if (major == 2 && (layer < 0 || layer >= cells_.z)) break;
                    layer = wrappedInto(layer, cells_[major]);
                    const Rectangle& r = rectangles[size_t(j)];
                    if (isEmpty(major, layer, at[a] + r.a0, at[a] + r.a1, at[b] + r.b0, at[b] + r.b1)) continue;
                    length = std::min(cap, std::max(0, j - 1) * perLayer);
                    break;
                }
                lengths[i] = float(length);
            }
}

}  // namespace vcp::meso
