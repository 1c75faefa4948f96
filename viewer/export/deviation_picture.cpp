#include "viewer/export/deviation_picture.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/measure/mesh_samples.h"
#include "builder/stream/colour_encoding.h"
#include "viewer/annotation/picture_text.h"
#include "viewer/export/diverging_colours.h"

namespace vcp {

namespace {

constexpr glm::dvec3 kBackground(1, 1, 1), kInk(0.13, 0.13, 0.15), kFaint(0.72, 0.72, 0.74);
constexpr int kSide = 2;  // rays an edge of a pixel
constexpr size_t kPictureBins = 120;

glm::dvec3 lightOf(glm::dvec3 srgb) { return {srgbToLinear(srgb.x), srgbToLinear(srgb.y), srgbToLinear(srgb.z)}; }

/// The light that comes along rays: colours of distances, shaded a little so that shape shows and colours stay what
/// they are on the scale.
class DeviationRays {
public:
    DeviationRays(const MeshBvh& surface, const DeviationTarget& target, const DeviationPictureOptions& options)
        : surface_(surface), target_(target), options_(options), width_(options.width - scaleWidth(options.width)) {}

    [[nodiscard]] uint32_t width() const { return width_; }

    [[nodiscard]] glm::dvec3 pixel(uint32_t x, uint32_t y) const {
        glm::dvec3 sum(0);
        for (int sample = 0; sample < kSide * kSide; ++sample) {
            const double px = double(x) + (sample % kSide + 0.5) / kSide,
                         py = double(y) + (sample / kSide + 0.5) / kSide;
            sum += light(cameraRay(options_.camera, width_, options_.height, px, py));
        }
        sum /= double(kSide * kSide);
        return {linearToSrgb(sum.x), linearToSrgb(sum.y), linearToSrgb(sum.z)};
    }

private:
    [[nodiscard]] glm::dvec3 light(const CameraRay& ray) const {
        const auto hit = surface_.nearestHit(ray.origin, ray.direction);
        if (!hit) return lightOf(kBackground);
        const double distance = target_.distance(ray.origin + hit->t * ray.direction, options_.within);
        const double facing = std::abs(glm::dot(hit->normal, ray.direction));
        return lightOf(divergingColour(distance / options_.range)) * (0.45 + 0.55 * facing);
    }

    const MeshBvh& surface_;
    const DeviationTarget& target_;
    const DeviationPictureOptions& options_;
    uint32_t width_;
};

/// A whole number of steps of 1, 2 or 5 times a power of ten, at most `most` of them in `range`.
double stepFor(double range, int most) {
    const double least = range / most, power = std::pow(10.0, std::floor(std::log10(least)));
    for (const double factor : {1.0, 2.0, 5.0})
        if (factor * power >= least) return factor * power;
    return 10 * power;
}

/// Draws the bar of colours, its numbers, the histogram beside it and the figures above.
void drawScale(Picture& picture, const Deviation& deviation, const DeviationPictureOptions& options) {
    const double em = std::max(double(options.height) / 70, 6.0);  // height of capitals
    const int left = int(options.width - scaleWidth(options.width));
    const int bar = left + int(em), barEnd = bar + int(2 * em);
    const int top = int(14.5 * em), bottom = int(options.height) - int(4 * em);
    const std::string unit = options.unit.empty() ? "" : " " + options.unit;

    const std::pair<const char*, double> figures[] = {
        {"mean", deviation.mean},          {"rms", deviation.rms},
        {"p5", deviation.quantile(0.05)},  {"p50", deviation.quantile(0.5)},
        {"p95", deviation.quantile(0.95)}, {"max", deviation.absoluteQuantile(1)}};
    double line = 2.5 * em;
    for (const auto& [name, value] : figures) {
        drawText(picture, name, {double(bar), line}, em, kInk);
        drawText(picture, fmt::format("{:.4g}{}", value, unit), {bar + 5.5 * em, line}, em, kInk);
        line += 1.75 * em;
    }

    const auto heightOf = [&](double value) {
        return (bottom + top) / 2.0 - value / options.range * (bottom - top) / 2.0;
    };
    for (int y = top; y < bottom; ++y) {
        const double value = ((bottom + top) / 2.0 - (y + 0.5)) / ((bottom - top) / 2.0);
        fillRectangle(picture, {bar, y}, {barEnd, y + 1}, divergingColour(value));
    }
    const double step = stepFor(2 * options.range, 10);
    const int most = int(std::floor(options.range / step * (1 + 1e-9)));
    double widest = 0;
    for (int i = -most; i <= most; ++i) {
        const double y = heightOf(i * step);
        drawLine(picture, {double(barEnd), y}, {barEnd + 0.5 * em, y}, 1.2, kInk);
        const std::string text = fmt::format("{:.4g}", i * step);
        drawText(picture, text, {barEnd + em, y + em / 2}, em, kInk);
        widest = std::max(widest, textWidth(text, em));
    }
    if (!options.unit.empty()) drawText(picture, options.unit, {barEnd + em, top - 0.9 * em}, em, kInk);

    const DeviationHistogram histogram = histogramOf(deviation, options.range, kPictureBins);
    const double largest = double(std::max<uint64_t>(*std::ranges::max_element(histogram.counts), 1));
    const int base = barEnd + int(widest + 2 * em), end = int(options.width) - int(1.5 * em);
    drawLine(picture, {base - 1.0, double(top)}, {base - 1.0, double(bottom)}, 1, kFaint);
    for (int y = top; y < bottom; ++y) {
        const double part = double(bottom - 1 - y) / double(bottom - top);
        const size_t bin = std::min(size_t(part * double(kPictureBins)), kPictureBins - 1);
        const int reach = base + int(std::lround(double(end - base) * double(histogram.counts[bin]) / largest));
        const double middle = histogram.lowerEnd(bin) + histogram.binWidth() / 2;
        fillRectangle(picture, {base, y}, {reach, y + 1}, divergingColour(middle / options.range) * 0.88);
    }
    const double beyond = 100 * double(histogram.below + histogram.above) / double(deviation.distances.size());
    drawText(picture, fmt::format("{:.2g}% beyond", beyond), {double(bar), bottom + 2.4 * em}, em, kInk);
}

}  // namespace

uint32_t scaleWidth(uint32_t width) { return std::min(width / 2, std::max(width / 5, 160u)); }

Result<Picture> drawDeviation(const MeshBvh& surface, const DeviationTarget& target, const Deviation& deviation,
                              const DeviationPictureOptions& options) {
    Picture picture{options.width, options.height,
                    std::vector<uint8_t>(size_t{4} * options.width * options.height, 255)};
    const DeviationRays rays(surface, target, options);
    SampleRunner runner(options.threads, options.progress);
    const uint64_t pixels = uint64_t{rays.width()} * options.height;
    if (!runner.run(pixels, 0, 1, [&](uint64_t i) {
            const auto x = uint32_t(i % rays.width()), y = uint32_t(i / rays.width());
            const glm::dvec3 colour = rays.pixel(x, y);
            uint8_t* pixel = &picture.rgba[4 * (size_t{y} * options.width + x)];
            for (int c = 0; c < 3; ++c) pixel[c] = toByte(colour[c]);
        }))
        return Error::cancelled();
    drawScale(picture, deviation, options);
    return picture;
}

}  // namespace vcp
