#include "viewer/bench/picture/picture_difference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

namespace vcp {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

size_t pixelAt(const LightPicture& picture, int x, int y) { return size_t(y) * picture.size.x + x; }

bool isCovered(const LightPicture& picture, size_t pixel) { return picture.coverage[pixel] >= 0.5f; }

/// Whether the pixel's light is apart from all eight neighbours' and all nine show something.
bool isApart(const LightPicture& picture, int x, int y) {
    const size_t at = pixelAt(picture, x, y);
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
            const size_t other = pixelAt(picture, x + dx, y + dy);
            if (!std::isfinite(picture.depth[other])) return false;
            if (other != at && !(std::abs(picture.light[at] - picture.light[other]) > kIsolatedLight)) return false;
        }
    return true;
}

/// Squared distances along one line to the nearest of the given ones (Felzenszwalb and Huttenlocher 2012, 2).
void transformLine(std::vector<double>& line, std::vector<int>& parabolas, std::vector<double>& bounds) {
    const int count = int(line.size());
    const std::vector<double> f = line;
    parabolas.assign(line.size(), 0);
    bounds.assign(line.size() + 1, kInfinity);
    int last = -1;
    for (int q = 0; q < count; ++q) {
        if (std::isinf(f[q])) continue;
        double from = -kInfinity;
        while (last >= 0) {
            const int v = parabolas[last];
            from = (f[q] + double(q) * q - f[v] - double(v) * v) / (2.0 * (q - v));
            if (from > bounds[last]) break;
            --last;
            from = -kInfinity;
        }
        parabolas[++last] = q;
        bounds[last] = from;
        bounds[last + 1] = kInfinity;
    }
    if (last < 0) return;
    for (int q = 0, k = 0; q < count; ++q) {
        while (bounds[k + 1] < q) ++k;
        line[q] = double(q - parabolas[k]) * (q - parabolas[k]) + f[parabolas[k]];
    }
}

/// Returns for each pixel the squared distance to the nearest one of `marked`; infinite where there is none.
std::vector<double> squaredDistances(const std::vector<uint8_t>& marked, glm::ivec2 size) {
    std::vector<double> distances(marked.size());
    for (size_t i = 0; i < marked.size(); ++i) distances[i] = marked[i] ? 0 : kInfinity;
    std::vector<int> parabolas;
    std::vector<double> bounds, line;
    for (int axis = 0; axis < 2; ++axis) {
        const int lines = axis == 0 ? size.x : size.y, length = axis == 0 ? size.y : size.x;
        const int step = axis == 0 ? size.x : 1, across = axis == 0 ? 1 : size.x;
        for (int i = 0; i < lines; ++i) {
            line.resize(length);
            for (int k = 0; k < length; ++k) line[k] = distances[size_t(i) * across + size_t(k) * step];
            transformLine(line, parabolas, bounds);
            for (int k = 0; k < length; ++k) distances[size_t(i) * across + size_t(k) * step] = line[k];
        }
    }
    return distances;
}

std::vector<uint8_t> outlineOf(const LightPicture& picture) {
    const int width = picture.size.x, height = picture.size.y;
    std::vector<uint8_t> outline(picture.coverage.size(), 0);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (!isCovered(picture, pixelAt(picture, x, y))) continue;
            const auto open = [&](int u, int v) {
                return u >= 0 && v >= 0 && u < width && v < height && !isCovered(picture, pixelAt(picture, u, v));
            };
            outline[pixelAt(picture, x, y)] = open(x - 1, y) || open(x + 1, y) || open(x, y - 1) || open(x, y + 1);
        }
    return outline;
}

}  // namespace

double lightError(const LightPicture& reference, const LightPicture& picture) {
    double sum = 0;
    for (size_t i = 0; i < picture.light.size(); ++i) {
        const double difference = double(picture.light[i]) - reference.light[i];
        sum += difference * difference;
    }
    return std::sqrt(sum / double(std::max<size_t>(picture.light.size(), 1)));
}

std::vector<glm::ivec2> isolatedPixels(const LightPicture& picture, const Camera& camera) {
    const auto width = uint32_t(picture.size.x), height = uint32_t(picture.size.y);
    const double perPixel = 2 * cameraBasis(camera, width, height).halfHeight / height;
    const bool parallel = camera.projection == Projection::Orthographic;
    std::vector<glm::ivec2> isolated;
    for (int y = 1; y + 1 < picture.size.y; ++y)
        for (int x = 1; x + 1 < picture.size.x; ++x) {
            if (!isApart(picture, x, y)) continue;
            const glm::vec3 ray(cameraRay(camera, width, height, x + 0.5, y + 0.5).direction);
            const double depth = picture.depth[pixelAt(picture, x, y)];
            double cosines = 0, farthest = 0;
            for (int i = 0; i < 9; ++i) {
                const size_t other = pixelAt(picture, x + i % 3 - 1, y + i / 3 - 1);
                if (i != 4) cosines += std::abs(glm::dot(picture.normals[other], ray));
                farthest = std::max(farthest, std::abs(depth - picture.depth[other]));
            }
            const double footprint = perPixel * (parallel ? 1 : depth);
            if (farthest < kIsolatedFootprints * footprint / std::max(cosines / 8, kIsolatedCosine))
                isolated.emplace_back(x, y);
        }
    return isolated;
}

SilhouetteDifference silhouetteDifference(const LightPicture& reference, const LightPicture& picture) {
    SilhouetteDifference difference;
    for (size_t i = 0; i < picture.coverage.size(); ++i)
        difference.pixels += isCovered(reference, i) != isCovered(picture, i) ? 1 : 0;
    const std::vector<uint8_t> outlines[] = {outlineOf(reference), outlineOf(picture)};
    std::vector<float> distances;
    for (int i = 0; i < 2; ++i) {
        const std::vector<double> squared = squaredDistances(outlines[1 - i], picture.size);
        // Where a picture has no outline at all, the other's is as far from it as the picture is large.
        const double most = std::hypot(picture.size.x, picture.size.y);
        for (size_t k = 0; k < squared.size(); ++k)
            if (outlines[i][k]) distances.push_back(float(std::min(std::sqrt(squared[k]), most)));
    }
    difference.distancePixels = quantilesOf(std::move(distances));
    return difference;
}

Quantiles normalDifference(const LightPicture& reference, const LightPicture& picture) {
    std::vector<float> degrees;
    for (size_t i = 0; i < picture.normals.size(); ++i) {
        if (reference.coverage[i] < 1 || picture.coverage[i] < 1) continue;
        const double cosine = std::clamp(double(glm::dot(reference.normals[i], picture.normals[i])), -1.0, 1.0);
        degrees.push_back(float(std::acos(cosine) * 180 / std::numbers::pi));
    }
    return quantilesOf(std::move(degrees));
}

}  // namespace vcp
