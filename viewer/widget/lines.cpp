#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "viewer/annotation/overlay_lines.h"
#include "viewer/widget/handles.h"

namespace vcp::widget {

namespace {

constexpr float kMostWidth = 256;
constexpr uint32_t kMostPoints = 1 << 24;

Result<OverlayLine> lineFrom(const vcp_line& given, uint32_t number) {
    const auto refused = [&](const char* why) {
        return Error{.code = ErrorCode::Usage, .message = why, .element = fmt::format("line {}", number)};
    };
    if (given.point_count > kMostPoints) return refused("has more than 16 million points");
    if (given.point_count > 0 && !given.points) return refused("has no points");
    if (!(given.width >= 0 && given.width <= kMostWidth)) return refused("its width is not 0 to 256 pixels");
    for (const float part : given.colour)
        if (!(part >= 0 && part <= 1)) return refused("its colour is not 0 to 1");
    OverlayLine line;
    const bool hasColour =
        std::any_of(std::begin(given.colour), std::end(given.colour), [](float c) { return c != 0; });
    if (hasColour) line.colour = {given.colour[0], given.colour[1], given.colour[2]};
    if (hasColour) line.opacity = given.colour[3];
    if (given.width > 0) line.width = given.width;
    line.points.reserve(given.point_count);
    for (size_t i = 0; i < given.point_count; ++i) {
        const double* at = given.points + 3 * i;
        if (!std::isfinite(at[0]) || !std::isfinite(at[1]) || !std::isfinite(at[2]))
            return refused("a point of it is not finite");
        line.points.emplace_back(at[0], at[1], at[2]);
    }
    return line;
}

}  // namespace

Result<void> setLines(vcp_view& view, const vcp_line* lines, uint32_t count) {
    std::vector<OverlayLine> taken;
    VCP_TRY(takeArray(lines, count, [&](const vcp_line& given, uint32_t number) -> Result<void> {
        VCP_TRY_ASSIGN(auto line, lineFrom(given, number));
        taken.push_back(std::move(line));
        return {};
    }));
    view.hasNewLines = true;
    if (taken.empty()) {
        view.viewer->renderer().paintOver({});
        return {};
    }
    const auto paint = [viewer = view.viewer.get(), all = std::move(taken)](const FrameRequest& request,
                                                                            Picture& picture) {
        // While the camera moves, pictures may be smaller than the view.
        paintLines(all, request.camera, picture, float(picture.width) / float(std::max(viewer->size().x, 1)));
    };
    view.viewer->renderer().paintOver(paint);
    return {};
}

}  // namespace vcp::widget
