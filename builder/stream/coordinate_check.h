// What of texture coordinates says where an image lies on a triangle.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/vec2.hpp>

namespace vcp {

/// Mends texture coordinates that cannot be used, and warns once of each kind.
class CoordinateCheck {
public:
    /// Single precision has less than a sixteenth of a repetition there.
    static constexpr float kFarthest = 1e6f;

    /// Returns the coordinates of a corner; 0 where they are no numbers. `where`: says the file and the element.
    template <class Where>
    glm::vec2 usable(glm::vec2 uv, const Where& where, std::vector<std::string>& warnings) {
        if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) {
            if (!std::exchange(hasNoNumbers_, true))
                warnings.push_back(fmt::format(
                    "{} has texture coordinates that are no numbers, and others may, too; 0 stands for them", where()));
            return glm::vec2(0);
        }
        if ((std::abs(uv.x) > kFarthest || std::abs(uv.y) > kFarthest) && !std::exchange(isFar_, true))
            warnings.push_back(
                fmt::format("{} has texture coordinates beyond 1,000,000, and others may, too; they are too coarse to "
                            "say where the image lies",
                            where()));
        return uv;
    }

    /// Notes that a triangle with an image has no coordinates.
    template <class Where>
    void noteAbsent(const Where& where, std::vector<std::string>& warnings) {
        if (!std::exchange(isAbsent_, true))
            warnings.push_back(fmt::format(
                "{} has an image and no texture coordinates, and others may, too; it is shown without them", where()));
    }

private:
    bool hasNoNumbers_ = false, isFar_ = false, isAbsent_ = false;
};

}  // namespace vcp
