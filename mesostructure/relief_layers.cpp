#include "mesostructure/relief_layers.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace vcp::meso {

namespace {

/// Returns the heights at which the side changes along a line down, over the slab's height.
std::vector<double> boundsBelow(const Shape& shape, double x, double y) {
    const double top = shape.extent().z, least = top / 4096;
    std::vector<double> bounds;
    bool inside = shape.field({x, y, top}) <= 0;
    if (inside) bounds.push_back(1);
    for (double z = top; z > 0;) {
        // The field is at most the distance, so no surface lies within it.
        const double next = std::max(0.0, z - std::max(least, std::abs(shape.field({x, y, z}))));
        double outer = z, inner = next;
        if ((shape.field({x, y, next}) <= 0) != inside) {
            for (int i = 0; i < 24; ++i) {
                const double middle = 0.5 * (outer + inner);
                ((shape.field({x, y, middle}) <= 0) == inside ? outer : inner) = middle;
            }
            bounds.push_back(0.5 * (outer + inner) / top);
            inside = !inside;
        }
        z = next;
    }
    if (inside) bounds.push_back(0);
    return bounds;
}

}  // namespace

Result<ReliefLayers> traceLayers(const Shape& shape, glm::ivec2 texels, int layers) {
    if (texels.x < 1 || texels.y < 1 || texels.x > kMaxGridEdge || texels.y > kMaxGridEdge)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("layers of {} x {} texels; each edge must have 1 to {}", texels.x, texels.y,
                                            kMaxGridEdge)};
    if (layers < 2 || layers > ReliefLayers::kMost || layers % 2 != 0)
        return Error{
            .code = ErrorCode::Usage,
            .message = fmt::format("{} layers; their number must be even, from 2 to {}", layers, ReliefLayers::kMost)};
    ReliefLayers made{texels, shape.extent(), layers, {}, 0};
    made.bounds.resize(size_t(texels.x) * size_t(texels.y) * size_t(layers));
    for (int y = 0; y < texels.y; ++y)
        for (int x = 0; x < texels.x; ++x) {
            const std::vector<double> bounds =
                boundsBelow(shape, double(x) / texels.x * made.extent.x, double(y) / texels.y * made.extent.y);
            made.cutColumns += bounds.size() > size_t(layers);
            uint16_t* to = &made.bounds[(size_t(y) * size_t(texels.x) + size_t(x)) * size_t(layers)];
            // Ground on the slab's bottom is a step above it: at 0 it would be no solid.
            for (size_t k = 0; k < std::min(bounds.size(), size_t(layers)); ++k)
                to[k] = uint16_t(std::max(k % 2 == 0 ? 1L : 0L, std::lround(65535 * bounds[k])));
        }
    return made;
}

}  // namespace vcp::meso
