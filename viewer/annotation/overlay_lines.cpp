#include "viewer/annotation/overlay_lines.h"

#include <algorithm>
#include <utility>

#include "viewer/annotation/pixels.h"
#include "viewer/annotation/projector.h"

namespace vcp {

namespace {

/// How much of each pixel a line covers, and which it touches.
class Coverage {
public:
    explicit Coverage(glm::ivec2 size) : size_(size), parts_(size_t(size.x) * size_t(size.y), 0.0f) {}

    void add(const Segment& segment, double width) {
        visitLine(segment, width, size_, [this](glm::ivec2 pixel, float part) {
            float& covered = parts_[at(pixel)];
            if (covered == 0) touched_.push_back(pixel);
            covered = std::max(covered, part);
        });
    }

    /// Calls paint(pixel, part) for each pixel that is touched, and forgets them.
    template <class Paint>
    void take(const Paint& paint) {
        for (const glm::ivec2 pixel : touched_) paint(pixel, std::exchange(parts_[at(pixel)], 0.0f));
        touched_.clear();
    }

private:
    [[nodiscard]] size_t at(glm::ivec2 pixel) const { return size_t(pixel.y) * size_t(size_.x) + size_t(pixel.x); }

    glm::ivec2 size_;
    std::vector<float> parts_;
    std::vector<glm::ivec2> touched_;
};

}  // namespace

void paintLines(std::span<const OverlayLine> lines, const Camera& camera, Picture& picture, float scale) {
    const glm::uvec2 size(picture.width, picture.height);
    const Projector projector(camera, size);
    Coverage coverage{glm::ivec2(size)};
    for (const OverlayLine& line : lines) {
        for (size_t i = 1; i < line.points.size(); ++i)
            if (const auto segment = projector.segment(line.points[i - 1], line.points[i]))
                coverage.add(*segment, double(line.width * scale));
        coverage.take([&](glm::ivec2 pixel, float part) { blend(picture, pixel, line.colour, line.opacity * part); });
    }
}

}  // namespace vcp
