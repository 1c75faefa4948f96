// A mesh with images, whose colours are known everywhere: walls that meet at right angles, each of a few triangles.
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "builder/build.h"
#include "tests/support/png_files.h"

namespace vcp::test {

/// RGB in the low bytes.
using TexelAt = std::function<uint32_t(uint32_t x, uint32_t y)>;

inline void writeTexels(const std::filesystem::path& path, uint32_t width, uint32_t height, const TexelAt& texel) {
    std::string rows;
    for (uint32_t y = 0; y < height; ++y) {
        rows += '\0';
        for (uint32_t x = 0; x < width; ++x)
            for (int channel = 0; channel < 3; ++channel) rows += char(texel(x, y) >> 8 * channel & 255u);
    }
    std::ofstream(path, std::ios::binary) << pngFile(width, height, 8, 2, rows);
}

/// Returns how a mesh is built whose images are kept.
inline BuildOptions keepingImages(const std::filesystem::path& mesh, const std::filesystem::path& output, double cell) {
    BuildOptions options;
    options.inputs = {mesh};
    options.output = output;
    options.cell = cell;
    options.threads = 2;
    options.overwrite = true;
    options.keepImages = true;
    return options;
}

/// The floor, z = 0, and the wall, y = 0, both 4 long and 3 wide. The floor shows an image of 96 x 40 texels 2.5 times
/// along x and once along y; the wall, of another material, shows one of 64 x 64. A third wall, x = 0, has no image.
struct TexturedWalls {
    static constexpr double kLength = 4, kWidth = 3, kRepeats = 2.5;

    /// Coordinates as OBJ has them: v grows upwards.
    static glm::dvec2 floorPlace(glm::dvec3 p) { return {p.x / kLength * kRepeats, p.y / kWidth}; }
    static glm::dvec2 wallPlace(glm::dvec3 p) { return {p.x / kLength, p.z / kWidth}; }

    /// `backwards`: the triangles come in another order, and begin with other corners.
    static void write(const std::filesystem::path& folder, const TexelAt& floor, const TexelAt& wall,
                      bool backwards = false) {
        writeTexels(folder / "floor.png", 96, 40, floor);
        writeTexels(folder / "wall.png", 64, 64, wall);
        std::ofstream(folder / "walls.mtl") << "newmtl floor\nmap_Kd floor.png\nnewmtl wall\nmap_Kd wall.png\n"
                                               "newmtl bare\nKd 0.2 0.4 0.6\n";
        std::ofstream obj(folder / "walls.obj");
        obj << "mtllib walls.mtl\n";
        std::string faces;
        uint32_t vertices = 0;
        const auto quad = [&](const char* material, const std::array<glm::dvec3, 4>& corners, auto placeOf) {
            for (const glm::dvec3& p : corners) {
                const glm::dvec2 place = placeOf(p);
                obj << fmt::format("v {} {} {}\nvt {} {}\n", p.x, p.y, p.z, place.x, place.y);
            }
            const auto face = [&](uint32_t a, uint32_t b, uint32_t c) {
                return fmt::format("f {0}/{0} {1}/{1} {2}/{2}\n", vertices + a, vertices + b, vertices + c);
            };
            const std::string both = backwards ? face(4, 1, 3) + face(2, 3, 1) : face(1, 2, 3) + face(1, 3, 4);
            const std::string group = fmt::format("usemtl {}\n{}", material, both);
            faces = backwards ? group + faces : faces + group;
            vertices += 4;
        };
        quad("floor", {{{0, 0, 0}, {kLength, 0, 0}, {kLength, kWidth, 0}, {0, kWidth, 0}}}, floorPlace);
        quad("wall", {{{0, 0, 0}, {0, 0, kWidth}, {kLength, 0, kWidth}, {kLength, 0, 0}}}, wallPlace);
        quad("bare", {{{0, 0, 0}, {0, kWidth, 0}, {0, kWidth, kWidth}, {0, 0, kWidth}}}, floorPlace);
        obj << faces;
    }
};

}  // namespace vcp::test
