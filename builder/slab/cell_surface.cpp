#include "builder/slab/cell_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "builder/stream/colour_encoding.h"

namespace vcp {

namespace {

/// Returns bounds of dot(n, x) in a box.
Extent extentInBox(const glm::dvec3& lower, const glm::dvec3& upper, const glm::dvec3& n) {
    Extent sum{0, 0};
    for (int i = 0; i < 3; ++i) {
        const double a = n[i] * lower[i], b = n[i] * upper[i];
        sum.first += std::min(a, b);
        sum.last += std::max(a, b);
    }
    return sum;
}

glm::dmat3 matrixOf(const std::array<float, 6>& m) {
    const double xx = double(m[0]), yy = double(m[1]), zz = double(m[2]);
    const double yz = double(m[3]), zx = double(m[4]), xy = double(m[5]);
    return {glm::dvec3(xx, xy, zx), glm::dvec3(xy, yy, yz), glm::dvec3(zx, yz, zz)};
}

}  // namespace

// For every m, the sum of the box's extent along n - m axis and of the slab's along m axis is a bound; the least of
// them, which is the extent itself (duality of linear programs), is at m = 0 or where an entry of n - m axis is 0.
Extent extentAlong(const CellSurface& cell, glm::dvec3 n) {
    const glm::dvec3 axis(cell.axis), lower(cell.lower), upper(cell.upper);
    Extent least = extentInBox(lower, upper, n);
    for (int i = 0; i < 3; ++i) {
        if (axis[i] == 0 || n[i] == 0) continue;
        const double m = n[i] / axis[i];
        const Extent box = extentInBox(lower, upper, n - m * axis);
        const double first = m * double(cell.first), last = m * double(cell.last);
        least.first = std::max(least.first, box.first + (m > 0 ? first : last));
        least.last = std::min(least.last, box.last + (m > 0 ? last : first));
    }
    return least;
}

Extent extentAlong(std::span<const CellSurface> eighths, std::span<const uint32_t> octants, glm::dvec3 n) {
    Extent all{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (size_t i = 0; i < eighths.size(); ++i) {
        const Extent one = extentAlong(eighths[i], n);
        const double at = glm::dot(n, octantCentre(octants[i]));
        all.first = std::min(all.first, at + one.first / 2);
        all.last = std::max(all.last, at + one.last / 2);
    }
    return all;
}

void chooseAxis(CellSurface& cell) {
    double xx = double(cell.moment[0]), yy = double(cell.moment[1]), zz = double(cell.moment[2]);
    double yz = double(cell.moment[3]), zx = double(cell.moment[4]), xy = double(cell.moment[5]);
    cell.axis = {0, 0, 1};
    // Squared often enough, the matrix has columns along its main direction only.
    constexpr int kSquarings = 6;
    for (int i = 0; i < kSquarings; ++i) {
        const double trace = xx + yy + zz;
        if (!(trace > 0)) return;
        const double scale = 1 / trace;
        for (double* entry : {&xx, &yy, &zz, &yz, &zx, &xy}) *entry *= scale;
        const double xx2 = xx * xx + xy * xy + zx * zx, yy2 = xy * xy + yy * yy + yz * yz,
                     zz2 = zx * zx + yz * yz + zz * zz;
        const double yz2 = xy * zx + yy * yz + yz * zz, zx2 = zx * xx + yz * xy + zz * zx,
                     xy2 = xx * xy + xy * yy + zx * yz;
        xx = xx2, yy = yy2, zz = zz2, yz = yz2, zx = zx2, xy = xy2;
        // Of trace 1, the squares of its main values are 1 together where there is one direction only.
        if (xx + yy + zz > 1 - 1e-13) break;
    }
    const glm::dvec3 column = xx >= yy && xx >= zz ? glm::dvec3(xx, xy, zx)
                              : yy >= zz           ? glm::dvec3(xy, yy, yz)
                                                   : glm::dvec3(zx, yz, zz);
    const double length = glm::length(column);
    if (length > 0) cell.axis = glm::vec3(column / length);
}

CellSurface foldEighths(std::span<const CellSurface> eighths, std::span<const uint32_t> octants) {
    CellSurface cell;
    cell.lower = glm::vec3(1);
    cell.upper = glm::vec3(-1);
    for (size_t i = 0; i < eighths.size(); ++i) {
        const CellSurface& e = eighths[i];
        const glm::vec3 centre(octantCentre(octants[i]));
        cell.lower = glm::min(cell.lower, centre + e.lower / 2.0f);
        cell.upper = glm::max(cell.upper, centre + e.upper / 2.0f);
        cell.area += e.area / 4;
        for (size_t k = 0; k < 6; ++k) cell.moment[k] += e.moment[k] / 4;
        cell.light += e.light / 4.0f;
        cell.parts |= e.parts;
    }
    chooseAxis(cell);
    const Extent extent = extentAlong(eighths, octants, glm::dvec3(cell.axis));
    cell.first = float(extent.first);
    cell.last = float(extent.last);
    return cell;
}

double normalSpread(const CellSurface& cell) {
    const double trace = double(cell.moment[0]) + double(cell.moment[1]) + double(cell.moment[2]);
    if (!(trace > 0)) return 0;
    const glm::dvec3 axis(cell.axis);
    return std::max(0.0, 1 - glm::dot(axis, matrixOf(cell.moment) * axis) / trace);
}

uint32_t meanColour(const CellSurface& cell) {
    if (!(cell.area > 0)) return 0xffffffffu;
    const glm::dvec4 mean = glm::dvec4(cell.light) / double(cell.area);
    return packRgba({byteOfLight(mean.r), byteOfLight(mean.g), byteOfLight(mean.b), toByte(mean.a)});
}

}  // namespace vcp
