#include "viewer/bench/picture/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace vcp {

namespace {

using Plane = std::vector<double>;

// The rows of the matrix from linear sRGB to XYZ, and the sums of its rows: white.
constexpr glm::dvec3 kX{10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794};
constexpr glm::dvec3 kY{2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897};
constexpr glm::dvec3 kZ{1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382};
constexpr glm::dvec3 kWhite{kX.x + kX.y + kX.z, kY.x + kY.y + kY.z, kZ.x + kZ.y + kZ.z};

glm::dvec3 linearOf(glm::dvec3 encoded) {
    for (int i = 0; i < 3; ++i)
        encoded[i] = encoded[i] <= 0.04045 ? encoded[i] / 12.92 : std::pow((encoded[i] + 0.055) / 1.055, 2.4);
    return encoded;
}

glm::dvec3 relativeXyz(glm::dvec3 linear) {
    return glm::dvec3(glm::dot(kX, linear), glm::dot(kY, linear), glm::dot(kZ, linear)) / kWhite;
}

glm::dvec3 linearOfRelativeXyz(glm::dvec3 relative) {
    static const glm::dmat3 inverse = glm::inverse(glm::transpose(glm::dmat3(kX, kY, kZ)));
    return inverse * (relative * kWhite);
}

// The linear opponent space YCxCz of 4.1.1.
glm::dvec3 opponentOf(glm::dvec3 linear) {
    const glm::dvec3 r = relativeXyz(linear);
    return {116 * r.y - 16, 500 * (r.x - r.y), 200 * (r.y - r.z)};
}

glm::dvec3 linearOfOpponent(glm::dvec3 c) {
    const double y = (c.x + 16) / 116;
    return linearOfRelativeXyz({y + c.y / 500, y, y - c.z / 200});
}

/// CIELAB, with the Hunt effect (4.1.2): colours that are darker look less colourful.
glm::dvec3 huntLab(glm::dvec3 linear) {
    const glm::dvec3 r = relativeXyz(linear);
    constexpr double kDelta = 6.0 / 29;
    const auto f = [](double t) {
        return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29;
    };
    const double lightness = 116 * f(r.y) - 16;
    return {lightness, 0.01 * lightness * 500 * (f(r.x) - f(r.y)), 0.01 * lightness * 200 * (f(r.y) - f(r.z))};
}

/// The HyAB distance (Abasi et al. 2020), 4.1.3.
double hyab(glm::dvec3 a, glm::dvec3 b) { return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z); }

/// A kernel of one dimension; the tap at `radius` is its middle.
struct Kernel {
    int radius = 0;
    std::vector<double> taps;
};

template <class Function>
Kernel sampled(int radius, const Function& of) {
    Kernel kernel{radius, std::vector<double>(2 * size_t(radius) + 1)};
    for (int i = -radius; i <= radius; ++i) kernel.taps[size_t(i + radius)] = of(i);
    return kernel;
}

double sumOf(const Kernel& kernel) {
    double sum = 0;
    for (const double tap : kernel.taps) sum += tap;
    return sum;
}

/// A plane of numbers that is filtered by products of two kernels; beyond its borders the nearest pixel counts.
class Filter {
public:
    Filter(int width, int height) : width_(width), height_(height) {}

    [[nodiscard]] Plane apply(const Plane& in, const Kernel& across, const Kernel& down) const {
        Plane rows(in.size()), out(in.size());
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) {
                double sum = 0;
                for (int i = -across.radius; i <= across.radius; ++i)
                    sum += across.taps[size_t(i + across.radius)] * in[at(std::clamp(x + i, 0, width_ - 1), y)];
                rows[at(x, y)] = sum;
            }
        for (int y = 0; y < height_; ++y)
            for (int i = -down.radius; i <= down.radius; ++i) {
                const double tap = down.taps[size_t(i + down.radius)];
                const int from = std::clamp(y + i, 0, height_ - 1);
                for (int x = 0; x < width_; ++x) out[at(x, y)] += tap * rows[at(x, from)];
            }
        return out;
    }

private:
    [[nodiscard]] size_t at(int x, int y) const { return size_t(y) * width_ + x; }
    int width_, height_;
};

/// One term of a contrast sensitivity function in space (Table 1): a sqrt(pi / b) exp(-pi^2 r^2 / b), r in degrees.
struct Term {
    double a, b;
};
constexpr double kWidestTerm = 0.04;
const std::array<std::vector<Term>, 3> kSensitivity = {{{{1, 0.0047}}, {{1, 0.0053}}, {{34.1, 0.04}, {13.5, 0.025}}}};

Plane channelOf(const std::vector<glm::dvec3>& pixels, int channel) {
    Plane plane(pixels.size());
    for (size_t i = 0; i < pixels.size(); ++i) plane[i] = pixels[i][channel];
    return plane;
}

/// Filters the opponent channels by what an eye can resolve (4.1.1), and returns colours to be compared (4.1.2).
std::vector<glm::dvec3> perceived(const std::vector<glm::dvec3>& opponent, const Filter& filter,
                                  double pixelsPerDegree) {
    constexpr double kPi = std::numbers::pi;
    const int radius = int(std::ceil(3 * std::sqrt(kWidestTerm / (2 * kPi * kPi)) * pixelsPerDegree));
    std::vector<glm::dvec3> filtered(opponent.size(), glm::dvec3(0));
    for (int channel = 0; channel < 3; ++channel) {
        const Plane plane = channelOf(opponent, channel);
        double total = 0;
        Plane sum(plane.size());
        for (const Term& term : kSensitivity[channel]) {
            Kernel kernel = sampled(radius, [&](int i) {
                const double degrees = i / pixelsPerDegree;
                return std::exp(-kPi * kPi * degrees * degrees / term.b);
            });
            const double weight = term.a * std::sqrt(kPi / term.b);
            total += weight * sumOf(kernel) * sumOf(kernel);
            const Plane part = filter.apply(plane, kernel, kernel);
            for (size_t i = 0; i < part.size(); ++i) sum[i] += weight * part[i];
        }
        for (size_t i = 0; i < sum.size(); ++i) filtered[i][channel] = sum[i] / total;
    }
    for (glm::dvec3& pixel : filtered) pixel = huntLab(glm::clamp(linearOfOpponent(pixel), 0.0, 1.0));
    return filtered;
}

/// The greatest difference in colour, raised to the power of 4.1.3: between green and blue.
constexpr double kColourPower = 0.7;
double largestColourDifference() { return std::pow(hyab(huntLab({0, 1, 0}), huntLab({0, 0, 1})), kColourPower); }

/// Maps a difference in colour to 0 to 1 (4.1.3): the lower 40 % of the range get 95 % of the values.
double mappedColourDifference(double difference, double largest) {
    constexpr double kKnee = 0.4, kAtKnee = 0.95;
    const double knee = kKnee * largest;
    return difference < knee ? kAtKnee / knee * difference
                             : kAtKnee + (difference - knee) / (largest - knee) * (1 - kAtKnee);
}

/// The sizes of edges and points at each pixel (4.2).
struct Features {
    Plane edges, points;
};

/// Scales positive taps to a sum of 1 and negative ones to -1.
Kernel balanced(Kernel kernel) {
    double above = 0, below = 0;
    for (const double tap : kernel.taps) (tap > 0 ? above : below) += tap;
    for (double& tap : kernel.taps) tap /= tap > 0 ? above : -below;
    return kernel;
}

Features featuresOf(const std::vector<glm::dvec3>& opponent, const Filter& filter, double pixelsPerDegree) {
    constexpr double kFeatureDegrees = 0.082;
    const double deviation = 0.5 * kFeatureDegrees * pixelsPerDegree;
    const int radius = int(std::ceil(3 * deviation));
    const auto gauss = [&](int i) { return std::exp(-i * i / (2 * deviation * deviation)); };
    Kernel smooth = sampled(radius, gauss);
    const double total = sumOf(smooth);
    for (double& tap : smooth.taps) tap /= total;
    const Kernel edge = balanced(sampled(radius, [&](int i) { return -i * gauss(i); }));
    const Kernel point =
        balanced(sampled(radius, [&](int i) { return (i * i / (deviation * deviation) - 1) * gauss(i); }));
    Plane light = channelOf(opponent, 0);
    for (double& value : light) value = (value + 16) / 116;
    const auto length = [&](const Kernel& kernel) {
        Plane across = filter.apply(light, kernel, smooth);
        const Plane down = filter.apply(light, smooth, kernel);
        for (size_t i = 0; i < across.size(); ++i) across[i] = std::hypot(across[i], down[i]);
        return across;
    };
    return {length(edge), length(point)};
}

}  // namespace

std::vector<double> flip(const ColourPicture& reference, const ColourPicture& test, double pixelsPerDegree) {
    const Filter filter(reference.width, reference.height);
    std::array<std::vector<glm::dvec3>, 2> colours;
    std::array<Features, 2> features;
    for (int i = 0; i < 2; ++i) {
        std::vector<glm::dvec3> opponent = i == 0 ? reference.pixels : test.pixels;
        for (glm::dvec3& pixel : opponent) pixel = opponentOf(linearOf(pixel));
        features[i] = featuresOf(opponent, filter, pixelsPerDegree);
        colours[i] = perceived(opponent, filter, pixelsPerDegree);
    }
    const double largest = largestColourDifference();
    std::vector<double> differences(reference.pixels.size());
    for (size_t i = 0; i < differences.size(); ++i) {
        const double colour =
            mappedColourDifference(std::pow(hyab(colours[0][i], colours[1][i]), kColourPower), largest);
        const double feature = std::max(std::abs(features[0].edges[i] - features[1].edges[i]),
                                        std::abs(features[0].points[i] - features[1].points[i]));
        // A difference in features raises one in colour (4.3).
        differences[i] = std::pow(colour, 1 - std::sqrt(feature / std::numbers::sqrt2));
    }
    return differences;
}

}  // namespace vcp
