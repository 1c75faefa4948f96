// sRGB (IEC 61966-2-1): the colours that meshes and pictures store, and the light that they stand for.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "builder/stream/material.h"

namespace vcp {

/// Converts a stored value 0..1 to linear 0..1.
inline double srgbToLinear(double value) {
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// Gives srgbToLinear of each value that 8 bits store.
inline const std::array<double, 256>& lightOfByte() {
    static const std::array<double, 256> table = [] {
        std::array<double, 256> t{};
        for (size_t i = 0; i < t.size(); ++i) t[i] = srgbToLinear(double(i) / 255);
        return t;
    }();
    return table;
}

/// Converts a stored value 0..1 to linear 0..1, to within 10^-5: from a table, for what is done often.
inline double lightOfStored(double value) {
    const double at = std::min(std::max(0.0, value), 1.0) * 255;
    const size_t below = std::min(size_t(at), size_t{254});
    const auto& light = lightOfByte();
    return light[below] + (at - double(below)) * (light[below + 1] - light[below]);
}

inline double linearToSrgb(double light) {
    return light <= 0.0031308 ? light * 12.92 : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

/// Converts 0..1 to 8 bits; values outside are clamped, NaN becomes 0.
inline uint8_t toByte(double value) {
    // std::clamp is not used: here the order of the comparisons makes NaN 0.
    return uint8_t(std::min(std::max(0.0, value), 1.0) * 255 + 0.5);
}

inline Rgba8 packRgba(const std::array<uint8_t, 4>& c) {
    return Rgba8{c[0]} | Rgba8{c[1]} << 8 | Rgba8{c[2]} << 16 | Rgba8{c[3]} << 24;
}

/// Encodes linear colour, with a linear alpha, as it is stored.
inline Rgba8 encodeRgba(const std::array<double, 4>& light) {
    const auto channel = [](double value) { return toByte(linearToSrgb(std::min(std::max(0.0, value), 1.0))); };
    return packRgba({channel(light[0]), channel(light[1]), channel(light[2]), toByte(light[3])});
}

/// Converts linear 0..1 to the 8 bits that are nearest as stored values: encodeRgba's channels, from a table.
inline uint8_t byteOfLight(double light) {
    static const std::array<double, 255> ends = [] {
        std::array<double, 255> t{};
        for (size_t i = 0; i < t.size(); ++i) t[i] = srgbToLinear((double(i) + 0.5) / 255);
        return t;
    }();
    return uint8_t(std::upper_bound(ends.begin(), ends.end(), light) - ends.begin());
}

/// A mean of the light of stored colours, and of their alpha as it is. It does not depend on their order.
class LightMean {
public:
    void add(Rgba8 colour) {
        for (size_t c = 0; c < 3; ++c) sum_[c] += uint64_t(lightOfByte()[colour >> 8 * c & 255u] * kUnit + 0.5);
        sum_[3] += colour >> 24;
        ++count_;
    }
    /// At least one colour was added.
    [[nodiscard]] Rgba8 mean() const {
        Rgba8 mean = Rgba8((sum_[3] + count_ / 2) / count_) << 24;
        for (size_t c = 0; c < 3; ++c) mean |= Rgba8{byteOfLight(double(sum_[c]) / (kUnit * double(count_)))} << 8 * c;
        return mean;
    }

private:
    static constexpr double kUnit = 1u << 30;
    std::array<uint64_t, 4> sum_{};
    uint64_t count_ = 0;
};

/// Multiplies two stored colours, channel by channel. As sRGB is close to a power, the result is close to the stored
/// value of the product of the linear colours.
inline Rgba8 modulate(Rgba8 a, Rgba8 b) {
    Rgba8 product = 0;
    for (int shift = 0; shift < 32; shift += 8) {
        const uint32_t both = (a >> shift & 0xFF) * (b >> shift & 0xFF);
        product |= (both + 127) / 255 << shift;
    }
    return product;
}

}  // namespace vcp
