#include "builder/mask/triangle_weights.h"

#include <algorithm>
#include <cmath>

#include "octree/surface/leaf_math.h"
#include "octree/surface/vertex_normal.h"

namespace vcp {

namespace {

/// The corners by their weights, the heaviest first, as factors of their differences from it: so what is equal at all
/// corners stays as it is, to the last bit.
struct Order {
    int first, second, third;
    double ofSecond, ofThird;
    bool isMiddle;  // of an edge: neither end is heavier
};

Order orderOf(const Weights& w) {
    std::array<int, 3> order{0, 1, 2};
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return w.of[a] > w.of[b]; });
    const auto part = [&](int corner) { return std::ldexp(double(w.of[corner]), -Weights::kLog2One); };
    return {order[0], order[1], order[2], part(order[1]), part(order[2]), w.of[order[1]] == Weights::kOne / 2};
}

template <class Value>
Value between(const Order& o, const Value& first, const Value& second, const Value& third) {
    if (o.isMiddle) return (first + second) * 0.5;
    return first + ((second - first) * o.ofSecond + (third - first) * o.ofThird);
}

Rgba8 blendColours(const Order& o, Rgba8 first, Rgba8 second, Rgba8 third) {
    Rgba8 colour = 0;
    for (int shift = 0; shift < 32; shift += 8) {
        const auto channel = [&](Rgba8 c) { return double(c >> shift & 255u); };
        colour |= Rgba8(between(o, channel(first), channel(second), channel(third)) + 0.5) << shift;
    }
    return colour;
}

uint32_t blendNormals(const std::array<MaskCorner, 3>& corners, const Weights& w, const Order& o) {
    for (int i = 0; i < 3; ++i)
        if (w.of[i] > 0 && corners[size_t(i)].normal == kUnknownNormal) return kUnknownNormal;
    const auto normal = [&](int i) {
        const uint32_t code = corners[size_t(i)].normal;
        return code == kUnknownNormal ? glm::dvec3(0) : f64::decodeNormal(code);
    };
    if (w.of[o.second] == 0) return corners[size_t(o.first)].normal;
    const glm::dvec3 sum = between(o, normal(o.first), normal(o.second), normal(o.third));
    return sum == glm::dvec3(0) ? kUnknownNormal : packDirection(sum);
}

}  // namespace

glm::dvec2 placeOf(const std::array<glm::dvec2, 3>& texels, const Weights& w) {
    const auto part = [&](int corner) { return std::ldexp(double(w.of[corner]), -Weights::kLog2One); };
    return texels[0] + part(1) * (texels[1] - texels[0]) + part(2) * (texels[2] - texels[0]);
}

MaskCorner blend(const std::array<MaskCorner, 3>& corners, const Weights& weights) {
    const Order o = orderOf(weights);
    const MaskCorner &a = corners[size_t(o.first)], &b = corners[size_t(o.second)], &c = corners[size_t(o.third)];
    return {between(o, a.position, b.position, c.position),
            glm::vec2(between(o, glm::dvec2(a.uv), glm::dvec2(b.uv), glm::dvec2(c.uv))),
            blendColours(o, a.colour, b.colour, c.colour), blendNormals(corners, weights, o)};
}

}  // namespace vcp
