// Light from everywhere: what comes from surroundings so far away that only the direction counts.
//
// The light on a surface is a smooth function of its normal, whatever the surroundings are: a quadratic form holds it
// to within about 1 % of the mean (Ramamoorthi and Hanrahan 2001, "An Efficient Representation for Irradiance
// Environment Maps"). So a picture of any size becomes 27 numbers, and a turn of it costs nothing.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string_view>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace vcp {

struct EnvironmentLight {
    /// Red, green and blue light on a surface with the normal n: (n, 1) m (n, 1), where that is not below 0. Symmetric;
    /// z points up, and the picture's middle lies at +y. It is a part of the light that a white surface gives back.
    std::array<glm::mat4, 3> forms{};
    /// Red, green and blue radiance in the same unit, as coefficients of meso::f32::harmonicsOf, in the same axes.
    std::array<glm::vec3, 16> harmonics{};
    glm::vec3 up{0, 1, 0};  ///< of the surroundings, in world axes, unit
    float turn = 0;         ///< degrees that they are turned about it, to the left as seen from above
    float strength = 1;     ///< times that light, at least 0

    bool operator==(const EnvironmentLight&) const = default;
};
/// An environment is at most so strong.
constexpr float kStrongestEnvironment = 10;

/// Returns the light of a picture of all directions (equirectangular: the upper row looks up): radiance in any unit, at
/// least 0 and finite, row by row. Its exposure is chosen so that where a surface gets the most, it gets 1. `size`: at
/// least 1 x 1. Returns nothing for a picture that is black.
std::optional<EnvironmentLight> environmentLight(std::span<const glm::vec3> radiance, glm::uvec2 size);

/// The names of surroundings that need no file: a studio's lamps before dark walls, a sky that is overcast, and a clear
/// one with the sun.
inline constexpr std::array<const char*, 3> kEnvironmentNames = {"studio", "overcast", "clear"};
/// Returns their light; nothing for other names.
std::optional<EnvironmentLight> environmentNamed(std::string_view name);

/// Returns the light as FrameConstants::environment has it, times its strength, for normals in a dataset's axes.
std::array<glm::vec4, 9> environmentRows(const EnvironmentLight& light,
                                         const glm::dquat& worldFromDataset = {1, 0, 0, 0});

/// Returns the radiance as MesoView::harmonics has it, times its strength, in the world's axes.
std::array<glm::vec4, 16> environmentHarmonics(const EnvironmentLight& light);

/// Returns what is seen in surroundings that need no file: radiance by direction in their own axes, in the unit of
/// their light. Precondition: one of kEnvironmentNames.
std::function<glm::dvec3(glm::dvec3)> environmentRadiance(std::string_view name);

}  // namespace vcp
