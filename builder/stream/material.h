// What the triangles of a mesh may be painted with.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <variant>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

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

/// What of a material's triangles is there: where the alpha of an image is at least a cutoff. What is cut out is no
/// surface (builder/mask/).
struct MaskRule {
    ImageSource image;  ///< none: all is there
    /// From 0 to 1, of the image's alpha; above 1: nothing is there, whatever the image.
    double cutoff = 0.5;
    /// An image that is nowhere as opaque as the cutoff cuts nothing: glass.
    bool sparesGlass = false;
    /// Where the image is opaque throughout, its grey counts instead.
    bool mayBeGrey = false;
    glm::vec2 uvScale{1}, uvOffset{0};  ///< from the triangles' texture coordinates to the mask's

    [[nodiscard]] bool exists() const { return image.exists() || cutoff > 1; }
};

/// What a material has beside its colour (glTF 2.0, 3.9): further images, over the same texture coordinates and with
/// the same wrap modes, and factors.
struct MaterialChannels {
    ImageSource normals;   ///< from -1 to 1 in the image's own axes: right, up, away from the surface
    ImageSource surface;   ///< green: roughness; blue: metalness
    ImageSource emission;  ///< light, encoded as colours are
    float normalScale = 1;
    float roughness = 1, metalness = 1;  ///< 0 to 1: multiply the image's
    glm::vec3 emissionFactor{0};         ///< at least 0: multiplies the image's light

    /// Leaves out an image that cannot be read, with its factors, which say nothing without it.
    void forgetNormals() { normals = {}; }
    void forgetSurface() { surface = {}, roughness = 1, metalness = 0; }
    void forgetEmission() { emission = {}, emissionFactor = glm::vec3(0); }

    [[nodiscard]] bool exist() const {
        return normals.exists() || surface.exists() || emission.exists() || emissionFactor != glm::vec3(0);
    }
};

struct Material {
    std::string name;
    Rgba8 factor = kWhite;      ///< multiplies the other colours
    ImageSource image;          ///< image of the surface colour
    bool ignoresAlpha = false;  ///< all of the image is opaque, whatever its alpha
    MaskRule mask;
    bool isCutOut = false;  ///< what is transparent was cut out of the mesh (MaskRule)
    Wrap wrapU = Wrap::Repeat;
    Wrap wrapV = Wrap::Repeat;
    MaterialChannels channels;

    /// Whether texture coordinates matter.
    [[nodiscard]] bool hasImages() const { return image.exists() || channels.exist(); }
};

}  // namespace vcp
