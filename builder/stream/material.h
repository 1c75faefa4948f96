// What the triangles of a mesh may be painted with.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <variant>

namespace vcp {

/// A colour as it is shown (sRGB encoded), 8 bits a channel, R in the lowest byte; alpha is 255 where there is none.
using Rgba8 = uint32_t;

constexpr Rgba8 kWhite = 0xFFFFFFFF;
constexpr uint32_t kNoMaterial = 0xFFFFFFFF;

enum class Wrap : uint8_t { Repeat, Clamp, Mirror };

/// A picture that a mesh file names (PNG, JPEG), or holds. It is not read yet, and may not exist.
struct ImageSource {
    std::filesystem::path path;                ///< empty when embedded, and when there is none
    std::shared_ptr<const std::string> bytes;  ///< bytes of an embedded file
    [[nodiscard]] bool exists() const { return !path.empty() || bytes; }
};

struct Material {
    std::string name;
    Rgba8 factor = kWhite;  ///< multiplies the other colours
    ImageSource image;      ///< image of the surface colour
    Wrap wrapU = Wrap::Repeat;
    Wrap wrapV = Wrap::Repeat;
};

}  // namespace vcp
