// A mesh whose material has channels: a floor, two triangles, with images that each test makes.
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>

#include "tests/support/gltf_files.h"
#include "tests/support/textured_walls.h"

namespace vcp::test {

/// Lies in the plane z = 0, 4 long and 3 wide, and shows its images once; their rows go along x, from the edge with the
/// largest y down.
struct ChannelledFloor {
    static constexpr uint32_t kWidth = 96, kHeight = 64;  ///< of its images, texels

    // Images that are not given are not there.
    TexelAt colour, normals, surface, emission;
    double normalScale = 1, roughness = 1, metalness = 1;
    std::string emissionFactor = "1,1,1";
    bool isMirrored = false;         ///< images go along -x, which coordinates beyond them say
    std::string node = "";           ///< members of its node, each after a comma
    std::string normalTexture = "";  ///< members of its texture of normals, likewise

    [[nodiscard]] std::string document() const {
        GltfFile file;
        file.floats({0, 0, 0, 4, 0, 0, 4, 3, 0, 0, 3, 0}, "VEC3", 4);
        if (isMirrored)
            file.floats({1, 1, 0, 1, 0, 0, 1, 0}, "VEC2", 4);
        else
            file.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 4);
        file.accessor(bytesOf<uint16_t>({0, 1, 2, 0, 2, 3}), 5123, "SCALAR", 6);
        file.meshes = R"({"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":2,"material":0}]})";
        file.nodes = R"({"mesh":0)" + node + "}";
        std::string images, textures;
        const auto texture = [&](const TexelAt& texels, const char* name, const std::string& more = "") {
            if (!texels) return std::string();
            const size_t number = size_t(std::count(textures.begin(), textures.end(), '{'));
            images += fmt::format(R"({}{{"uri":"{}.png"}})", images.empty() ? "" : ",", name);
            textures += fmt::format(R"({}{{"source":{}}})", textures.empty() ? "" : ",", number);
            return fmt::format(R"({{"index":{}{}}})", number, more);
        };
        const auto member = [](const char* name, const std::string& value) {
            return value.empty() ? std::string() : fmt::format(R"("{}":{},)", name, value);
        };
        std::string material = member(
            "normalTexture", texture(normals, "normals", fmt::format(R"(,"scale":{}{})", normalScale, normalTexture)));
        material += member("emissiveTexture", texture(emission, "emission"));
        if (emission) material += member("emissiveFactor", "[" + emissionFactor + "]");
        std::string metallic = member("baseColorTexture", texture(colour, "colour"));
        metallic += member("metallicRoughnessTexture", texture(surface, "surface"));
        metallic += fmt::format(R"("roughnessFactor":{},"metallicFactor":{})", roughness, metalness);
        file.more = fmt::format(R"(,"images":[{}],"textures":[{}],"materials":[{{{}"pbrMetallicRoughness":{{{}}}}}])",
                                images, textures, material, metallic);
        return file.embedded();
    }

    /// Writes floor.gltf and its images into a folder.
    void write(const std::filesystem::path& folder) const {
        const std::pair<const TexelAt&, const char*> images[] = {
            {colour, "colour.png"}, {normals, "normals.png"}, {surface, "surface.png"}, {emission, "emission.png"}};
        for (const auto& [texels, name] : images)
            if (texels) writeTexels(folder / name, kWidth, kHeight, texels);
        std::ofstream(folder / "floor.gltf") << document();
    }

    static BuildOptions options(const std::filesystem::path& folder) {
        return keepingImages(folder / "floor.gltf", folder / "floor.vcp", 0.2);
    }
};

/// Returns a texel of an image of normals.
inline uint32_t normalTexel(double right, double up, double away) {
    const auto byte = [](double x) { return uint32_t(std::lround(127.5 + 127.5 * x)); };
    return byte(right) | byte(up) << 8 | byte(away) << 16;
}

}  // namespace vcp::test
