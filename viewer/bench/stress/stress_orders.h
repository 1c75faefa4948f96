// Compares orders in which pages may arrive: how far a picture is from the settled one, over the bytes that have come.
//
// Each order starts from nothing, with a renderer of its own that reads one page at a time; so bytes are what time is
// on a line of constant speed. What the picture settles on must not depend on the order.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "octree/io/result.h"
#include "render/view/renderer.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

struct OrderSample {
    double seconds = 0;  ///< since the start; mostly drawing
    uint64_t bytes = 0;  ///< decoded bytes of the pages that have come
    double error = 0;    ///< root of the mean squared difference to the settled picture, of colours from 0 to 255
};

struct OrderCurve {
    LoadOrder order = LoadOrder::Feedback;
    std::vector<OrderSample> samples;  ///< the first: the coarsest page alone; the last: settled
    double meanError = 0;              ///< mean over the bytes from the first sample to the last
    uint64_t bytesToTenth = 0;         ///< bytes until the error stayed below a tenth of the first
    Picture settled;
};

/// Draws `request` about `draws` times for each order. Blocks. Errors: those of Renderer; Cancelled, where `progress`
/// returns false.
Result<std::vector<OrderCurve>> compareOrders(
    const OpenDataset& open, const RendererOptions& options, const FrameRequest& request,
    const std::vector<LoadOrder>& orders, int draws,
    const std::function<bool(const std::string& what, double fraction)>& progress);

/// Parses names such as "feedback,nearest"; returns nothing where a name is unknown.
std::optional<std::vector<LoadOrder>> parseOrders(std::string_view text);

}  // namespace vcp
