#include "viewer/picture/overlay_lines.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

namespace vcp {

namespace {

// A segment is cut off where it is nearer to the eye's plane than this part of its length, or of its distance.
constexpr double kNear = 1e-6;

struct Segment {
    glm::dvec2 from, to;  // pixels
};

/// Projects points to pixels; pixel centres are at + 0.5.
class Projector {
public:
    Projector(const Camera& camera, const Picture& picture)
        : camera_(camera),
          basis_(cameraBasis(camera, picture.width, picture.height)),
          size_(picture.width, picture.height) {}

    /// Returns the part of the segment that is in front of the eye; nothing where there is none.
    [[nodiscard]] std::optional<Segment> segment(glm::dvec3 from, glm::dvec3 to) const {
        glm::dvec3 a = seen(from), b = seen(to);
        if (camera_.projection == Projection::Perspective) {
            const double near = kNear * (glm::length(a) + glm::length(b));
            if (!(a.z > near) && !(b.z > near)) return std::nullopt;
            if (!(a.z > near)) a = glm::mix(b, a, (b.z - near) / (b.z - a.z));
            if (!(b.z > near)) b = glm::mix(a, b, (a.z - near) / (a.z - b.z));
        }
        return Segment{pixel(a), pixel(b)};
    }

private:
    /// Returns a point in the camera's axes: right, up, forward.
    [[nodiscard]] glm::dvec3 seen(glm::dvec3 point) const {
        const glm::dvec3 from = point - camera_.eye;
        return {glm::dot(from, basis_.right), glm::dot(from, basis_.up), glm::dot(from, basis_.forward)};
    }
    [[nodiscard]] glm::dvec2 pixel(glm::dvec3 seen) const {
        const double depth = camera_.projection == Projection::Perspective ? seen.z : 1;
        return size_ * 0.5 *
               glm::dvec2(1 + seen.x / (depth * basis_.halfWidth), 1 - seen.y / (depth * basis_.halfHeight));
    }

    const Camera& camera_;
    CameraBasis basis_;
    glm::dvec2 size_;
};

/// Cuts a segment to what is within `margin` of the picture (Liang and Barsky 1984); false where nothing is.
bool cutToPicture(Segment& segment, glm::dvec2 size, double margin) {
    const glm::dvec2 along = segment.to - segment.from;
    double enter = 0, leave = 1;
    for (int axis = 0; axis < 2; ++axis) {
        double near = (-margin - segment.from[axis]) / along[axis];
        double far = (size[axis] + margin - segment.from[axis]) / along[axis];
        if (along[axis] == 0) {
            if (segment.from[axis] < -margin || segment.from[axis] > size[axis] + margin) return false;
            continue;
        }
        if (near > far) std::swap(near, far);
        enter = std::max(enter, near);
        leave = std::min(leave, far);
    }
    if (!(enter <= leave)) return false;
    segment = {segment.from + along * enter, segment.from + along * leave};
    return true;
}

double distanceTo(const Segment& segment, glm::dvec2 point) {
    const glm::dvec2 along = segment.to - segment.from;
    const double squared = glm::dot(along, along);
    const double t = squared > 0 ? std::clamp(glm::dot(point - segment.from, along) / squared, 0.0, 1.0) : 0;
    return glm::length(point - segment.from - along * t);
}

/// How much of each pixel a line covers, and which it touches.
class Coverage {
public:
    Coverage(uint32_t width, uint32_t height) : size_(width, height), parts_(size_t{width} * height, 0.0f) {}

    /// Adds a segment of that half width: pixel by pixel along its longer axis.
    void add(Segment segment, double half) {
        if (!cutToPicture(segment, size_, half + 1)) return;
        const glm::dvec2 along = segment.to - segment.from;
        const int major = std::abs(along.x) >= std::abs(along.y) ? 0 : 1, minor = 1 - major;
        const double reach = half + 1, slope = along[major] != 0 ? along[minor] / along[major] : 0;
        const double low = std::min(segment.from[major], segment.to[major]);
        const double high = std::max(segment.from[major], segment.to[major]);
        for (int i = from(low - reach); i <= to(high + reach, major); ++i) {
            const double middle = segment.from[minor] + slope * (std::clamp(i + 0.5, low, high) - segment.from[major]);
            const double side = reach * std::sqrt(1 + slope * slope);
            for (int j = from(middle - side); j <= to(middle + side, minor); ++j) {
                const glm::ivec2 pixel = major == 0 ? glm::ivec2(i, j) : glm::ivec2(j, i);
                cover(pixel, half + 0.5 - distanceTo(segment, glm::dvec2(pixel) + 0.5));
            }
        }
    }

    /// Calls paint(pixel, part) for each pixel that is touched, and forgets them.
    template <class Paint>
    void take(Paint paint) {
        for (const size_t pixel : touched_) paint(pixel, std::exchange(parts_[pixel], 0.0f));
        touched_.clear();
    }

private:
    [[nodiscard]] static int from(double low) { return int(std::max(0.0, std::floor(low))); }
    [[nodiscard]] int to(double high, int axis) const { return int(std::min(size_[axis] - 1, std::floor(high))); }
    void cover(glm::ivec2 pixel, double part) {
        if (part <= 0) return;
        const size_t at = size_t(pixel.y) * size_t(size_.x) + size_t(pixel.x);
        if (parts_[at] == 0) touched_.push_back(at);
        parts_[at] = std::max(parts_[at], float(std::min(part, 1.0)));
    }

    glm::dvec2 size_;
    std::vector<float> parts_;
    std::vector<size_t> touched_;
};

/// Puts a colour over a pixel, whose own is not multiplied with its alpha.
void blend(uint8_t* rgba, glm::vec3 colour, float opacity) {
    const float below = float(rgba[3]) / 255 * (1 - opacity), all = opacity + below;
    if (all <= 0) return;
    for (int channel = 0; channel < 3; ++channel) {
        const float mixed = (255 * colour[channel] * opacity + float(rgba[channel]) * below) / all;
        rgba[channel] = uint8_t(std::clamp(mixed + 0.5f, 0.0f, 255.0f));
    }
    rgba[3] = uint8_t(std::clamp(255 * all + 0.5f, 0.0f, 255.0f));
}

}  // namespace

void paintLines(std::span<const OverlayLine> lines, const Camera& camera, Picture& picture, float scale) {
    const Projector projector(camera, picture);
    Coverage coverage(picture.width, picture.height);
    for (const OverlayLine& line : lines) {
        for (size_t i = 1; i < line.points.size(); ++i)
            if (const auto segment = projector.segment(line.points[i - 1], line.points[i]))
                coverage.add(*segment, 0.5 * double(line.width * scale));
        coverage.take(
            [&](size_t pixel, float part) { blend(&picture.rgba[4 * pixel], line.colour, line.opacity * part); });
    }
}

}  // namespace vcp
