#include "render/environment_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>

#include "mesostructure/harmonics.h"

namespace vcp {

namespace {

constexpr double kPi = std::numbers::pi;
// How bright each channel looks (ITU-R BT.709).
constexpr glm::dvec3 kLuminance(0.2126, 0.7152, 0.0722);

/// Integrals of radiance over all directions d: of 1, of d, and of d times d, for each channel; and of the spherical
/// harmonics of band 3.
struct Moments {
    glm::dvec3 zeroth{0};
    std::array<glm::dvec3, 3> first{};
    std::array<glm::dmat3, 3> second{};
    std::array<glm::dvec3, 7> third{};
};

/// Returns the direction of a point of the picture, each coordinate from 0 to 1, from the left and from the top.
glm::dvec3 directionAt(double x, double y) {
    const double across = 2 * kPi * (x - 0.5), down = kPi * y;
    return {std::sin(down) * std::sin(across), std::sin(down) * std::cos(across), std::cos(down)};
}

/// Adds a row of the picture; `r`, `z`: sine and cosine of the angle from above.
void addRow(Moments& moments, const std::array<glm::dvec3, 10>& sums, double r, double z, double texel) {
    moments.zeroth += texel * sums[0];
    for (int c = 0; c < 3; ++c) {
        const auto sum = [&](size_t i) { return texel * sums[i][c]; };
        moments.first[size_t(c)] += glm::dvec3(r * sum(1), r * sum(2), z * sum(0));
        const double xx = r * r * sum(3), xy = r * r * sum(4), yy = r * r * sum(5), xz = r * z * sum(1),
                     yz = r * z * sum(2), zz = z * z * sum(0);
        moments.second[size_t(c)] += glm::dmat3(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    }
    const auto add = [&](size_t i, double scale, glm::dvec3 sum) { moments.third[i] += scale * texel * sum; };
    add(0, meso::f64::kBand3Outer * r * r * r, 3.0 * sums[7] - sums[9]);
    add(1, meso::f64::kBand3Mixed * r * r * z, sums[4]);
    add(2, meso::f64::kBand3Near * r * (5 * z * z - 1), sums[2]);
    add(3, meso::f64::kBand3Axis * z * (5 * z * z - 3), sums[0]);
    add(4, meso::f64::kBand3Near * r * (5 * z * z - 1), sums[1]);
    add(5, meso::f64::kBand3Square * r * r * z, sums[3] - sums[5]);
    add(6, meso::f64::kBand3Outer * r * r * r, sums[6] - 3.0 * sums[8]);
}

Moments momentsOf(std::span<const glm::vec3> radiance, glm::uvec2 size) {
    std::vector<glm::dvec2> across;  // of each column: what x and y are of the sine of the angle from above
    for (uint32_t x = 0; x < size.x; ++x) across.emplace_back(directionAt((x + 0.5) / size.x, 0.5));
    Moments moments;
    for (uint32_t y = 0; y < size.y; ++y) {
        // Sums over the row: of radiance, and of that times x, y, x x, x y, y y, x x x, x x y, x y y and y y y.
        std::array<glm::dvec3, 10> sums{};
        for (uint32_t x = 0; x < size.x; ++x) {
            const glm::dvec3 light(radiance[size_t{y} * size.x + x]);
            const glm::dvec2 a = across[x];
            sums[0] += light, sums[1] += a.x * light, sums[2] += a.y * light;
            const glm::dvec3 xx = a.x * a.x * light, xy = a.x * a.y * light, yy = a.y * a.y * light;
            sums[3] += xx, sums[4] += xy, sums[5] += yy;
            sums[6] += a.x * xx, sums[7] += a.y * xx, sums[8] += a.y * xy, sums[9] += a.y * yy;
        }
        const double from = std::cos(kPi * y / size.y), to = std::cos(kPi * (y + 1.0) / size.y);
        const double angle = kPi * (y + 0.5) / size.y, texel = (from - to) * 2 * kPi / size.x;
        addRow(moments, sums, std::sin(angle), std::cos(angle), texel);
    }
    return moments;
}

/// Returns the radiance's coefficients of spherical harmonics.
std::array<glm::vec3, 16> harmonicsOf(const Moments& m) {
    using namespace meso::f64;
    std::array<glm::dvec3, 16> h{};
    h[0] = double(kBand0) * m.zeroth;
    for (int c = 0; c < 3; ++c) {
        const glm::dvec3 first = m.first[size_t(c)];
        const glm::dmat3& q = m.second[size_t(c)];
        for (size_t i = 0; i < 3; ++i) h[1 + i][c] = kBand1 * first[int(i)];
        h[4][c] = kBand2Mixed * q[0][1], h[5][c] = kBand2Mixed * q[1][2], h[6][c] = kBand2Mixed * q[0][2];
        h[7][c] = kBand2Axis * (2 * q[2][2] - q[0][0] - q[1][1]), h[8][c] = kBand2Square * (q[0][0] - q[1][1]);
    }
    std::copy(m.third.begin(), m.third.end(), h.begin() + 9);
    std::array<glm::vec3, 16> rounded{};
    std::copy(h.begin(), h.end(), rounded.begin());
    return rounded;
}

/// Returns the forms of light that falls by the cosine. Its clamp, max(0, t), is 1/4 + t/2 + 5/32 (3 t t - 1) in the
/// three bands that matter.
EnvironmentLight lightOf(const Moments& moments) {
    EnvironmentLight light;
    for (size_t c = 0; c < 3; ++c) {
        glm::dmat4 form(15.0 / 32 * moments.second[c]);
        const glm::dvec3 half = 0.25 * moments.first[c];
        form[3] = glm::dvec4(half, 3.0 / 32 * moments.zeroth[int(c)]);
        for (int i = 0; i < 3; ++i) form[i][3] = half[i];
        light.forms[c] = form / kPi;
    }
    return light;
}

/// Returns the luminance of the most light that a surface gets, to a percent.
double mostLight(const EnvironmentLight& light) {
    constexpr int kDirections = 2000;
    double most = 0;
    for (int i = 0; i < kDirections; ++i) {
        const double z = 1 - (2 * i + 1.0) / kDirections, angle = i * kPi * (3 - std::sqrt(5.0));
        const double r = std::sqrt(1 - z * z);
        const glm::vec4 n(r * std::cos(angle), r * std::sin(angle), z, 1);
        glm::dvec3 channels(0);
        for (int c = 0; c < 3; ++c) channels[c] = std::max(0.0, double(glm::dot(n, light.forms[size_t(c)] * n)));
        most = std::max(most, glm::dot(channels, kLuminance));
    }
    return most;
}

/// Returns how much of a lamp is seen in a direction: 1 within `inner` of its middle, 0 beyond `outer`, radians.
double lampAt(glm::dvec3 d, glm::dvec3 towards, double inner, double outer) {
    const double angle = std::acos(std::clamp(glm::dot(d, glm::normalize(towards)), -1.0, 1.0));
    const double t = std::clamp((outer - angle) / (outer - inner), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

/// A large lamp in front on the left, a cool one on the right, and one behind above.
glm::dvec3 studioAt(glm::dvec3 d) {
    const glm::dvec3 wall = d.z < 0 ? glm::dvec3(0.16, 0.15, 0.14) : glm::dvec3(0.13 + 0.12 * d.z);
    return wall + 3.2 * lampAt(d, {-0.7, -0.7, 0.75}, 0.35, 0.7) * glm::dvec3(1.0, 0.96, 0.9) +
           1.1 * lampAt(d, {0.9, -0.45, 0.2}, 0.4, 0.8) * glm::dvec3(0.8, 0.9, 1.0) +
           2.4 * lampAt(d, {0.3, 0.9, 0.6}, 0.25, 0.5) * glm::dvec3(1.0);
}

/// The sky of Moon and Spencer (the CIE's overcast one), above ground that gives back a fifth of its light.
glm::dvec3 overcastAt(glm::dvec3 d) {
    return d.z < 0 ? glm::dvec3(0.155, 0.150, 0.140) : (1 + 2 * d.z) / 3 * glm::dvec3(0.97, 0.99, 1.0);
}

/// Blue, paler towards the horizon, with the sun and its halo in front on the left; above sunlit ground.
glm::dvec3 clearAt(glm::dvec3 d) {
    if (d.z < 0) return {0.36, 0.33, 0.28};
    const glm::dvec3 sun(-0.5, -0.55, 0.62);
    const glm::dvec3 sky = glm::mix(glm::dvec3(0.62, 0.72, 0.85), glm::dvec3(0.16, 0.33, 0.72), std::sqrt(d.z));
    return sky + glm::dvec3(1.0, 0.9, 0.74) * (22.0 * lampAt(d, sun, 0.1, 0.3) + 0.5 * lampAt(d, sun, 0.1, 1.0));
}

using Radiance = glm::dvec3 (*)(glm::dvec3 direction);

/// Returns what is seen in surroundings that need no file; nothing for other names.
Radiance radianceNamed(std::string_view name) {
    constexpr Radiance kAll[] = {studioAt, overcastAt, clearAt};
    const auto found = std::find(kEnvironmentNames.begin(), kEnvironmentNames.end(), name);
    return found != kEnvironmentNames.end() ? kAll[found - kEnvironmentNames.begin()] : nullptr;
}

constexpr glm::uvec2 kPictureSize(256, 128);

std::vector<glm::vec3> pictureOf(Radiance radiance) {
    std::vector<glm::vec3> picture;
    for (uint32_t y = 0; y < kPictureSize.y; ++y)
        for (uint32_t x = 0; x < kPictureSize.x; ++x)
            picture.emplace_back(radiance(directionAt((x + 0.5) / kPictureSize.x, (y + 0.5) / kPictureSize.y)));
    return picture;
}

/// Returns the smallest turn that brings a unit vector to the axis z.
glm::dquat turnToZ(glm::dvec3 v) {
    if (v.z < -1 + 1e-12) return {0, 1, 0, 0};
    return glm::normalize(glm::dquat(1 + v.z, glm::cross(v, glm::dvec3(0, 0, 1))));
}

/// Returns the turn from the world's axes to the surroundings' own.
glm::dquat ownFromWorld(const EnvironmentLight& light) {
    return glm::angleAxis(-glm::radians(double(light.turn)), glm::dvec3(0, 0, 1)) * turnToZ(light.up);
}

}  // namespace

std::optional<EnvironmentLight> environmentLight(std::span<const glm::vec3> radiance, glm::uvec2 size) {
    const Moments moments = momentsOf(radiance, size);
    EnvironmentLight light = lightOf(moments);
    const double most = mostLight(light);
    if (!(most > 0) || !std::isfinite(most)) return std::nullopt;
    for (glm::mat4& form : light.forms) form /= float(most);
    light.harmonics = harmonicsOf(moments);
    for (glm::vec3& coefficient : light.harmonics) coefficient /= float(most);
    return light;
}

std::optional<EnvironmentLight> environmentNamed(std::string_view name) {
    const Radiance radiance = radianceNamed(name);
    if (radiance == nullptr) return std::nullopt;
    return environmentLight(pictureOf(radiance), kPictureSize);
}

std::function<glm::dvec3(glm::dvec3)> environmentRadiance(std::string_view name) {
    const Radiance radiance = radianceNamed(name);
    const std::vector<glm::vec3> picture = pictureOf(radiance);
    const double exposure = double(environmentLight(picture, kPictureSize)->harmonics[0].g) /
                            (double(meso::f64::kBand0) * momentsOf(picture, kPictureSize).zeroth.g);
    return [=](glm::dvec3 direction) { return exposure * radiance(direction); };
}

std::array<glm::vec4, 9> environmentRows(const EnvironmentLight& light, const glm::dquat& worldFromDataset) {
    const glm::dmat3 toOwn = glm::mat3_cast(ownFromWorld(light) * worldFromDataset);
    std::array<glm::vec4, 9> rows{};
    for (int c = 0; c < 3; ++c) {
        const glm::dmat4 form = double(light.strength) * glm::dmat4(light.forms[size_t(c)]);
        const glm::dmat3 q = glm::transpose(toOwn) * glm::dmat3(form) * toOwn;
        const glm::dvec3 twice = 2.0 * (glm::transpose(toOwn) * glm::dvec3(form[3]));
        // z z is 1 - x x - y y.
        const double values[] = {form[3][3] + q[2][2], twice.x,     twice.y,           twice.z,          2 * q[0][1],
                                 2 * q[1][2],          2 * q[2][0], q[0][0] - q[2][2], q[1][1] - q[2][2]};
        for (size_t i = 0; i < rows.size(); ++i) rows[i][c] = float(values[i]);
    }
    return rows;
}

std::array<glm::vec4, 16> environmentHarmonics(const EnvironmentLight& light) {
    std::array<glm::vec4, 16> rows{};
    for (int c = 0; c < 3; ++c) {
        meso::f64::Harmonics own;
        for (size_t i = 0; i < 16; ++i) own.c[i] = double(light.strength * light.harmonics[i][c]);
        const meso::f64::Harmonics world =
            meso::f64::turnedHarmonics(own, glm::transpose(glm::mat3_cast(ownFromWorld(light))));
        for (size_t i = 0; i < 16; ++i) rows[i][c] = float(world.c[i]);
    }
    return rows;
}

}  // namespace vcp
