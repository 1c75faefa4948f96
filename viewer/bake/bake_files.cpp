#include "viewer/bake/bake_files.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "builder/stream/colour_encoding.h"
#include "mesostructure/asset_file.h"
#include "mesostructure/base/base_file.h"
#include "render/picture.h"
#include "viewer/bake/glb_base.h"
#include "viewer/picture/image_files.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A picture whose upper row is the last of a map.
template <class Colour>
Picture pictureOf(int size, const Colour& colour) {
    Picture picture{uint32_t(size), uint32_t(size), std::vector<uint8_t>(4 * size_t(size) * size_t(size))};
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const std::array<uint8_t, 3> c = colour(size_t(x) + size_t(size) * size_t(size - 1 - y));
            uint8_t* to = picture.rgba.data() + 4 * (size_t(x) + size_t(size) * size_t(y));
            to[0] = c[0], to[1] = c[1], to[2] = c[2], to[3] = 255;
        }
    return picture;
}

std::array<uint8_t, 3> maskColour(TexelState state) {
    switch (state) {
        case TexelState::Height:
            return {64, 144, 96};
        case TexelState::NoHit:
            return {208, 32, 48};
        case TexelState::Sheets:
            return {240, 160, 32};
        case TexelState::Steep:
            return {48, 96, 208};
        default:
            return {0, 0, 0};
    }
}

Result<void> writePictures(const fs::path& folder, const BakedMaps& maps) {
    const size_t size = size_t(maps.size);
    std::vector<uint16_t> rows(size * size);
    for (size_t y = 0; y < size; ++y)
        std::copy_n(maps.displacement.values.begin() + std::ptrdiff_t(y * size), size,
                    rows.begin() + std::ptrdiff_t((size - 1 - y) * size));
    VCP_TRY(writeGrey16(rows, uint32_t(size), uint32_t(size), folder / "displacement.png"));
    const auto signedByte = [](float value) {
        return uint8_t(std::lround(127.5f + 127.5f * std::clamp(value, -1.0f, 1.0f)));
    };
    VCP_TRY(writePng(pictureOf(maps.size,
                               [&](size_t texel) {
                                   const glm::vec3 n = maps.normals[texel];
                                   return std::array<uint8_t, 3>{signedByte(n.x), signedByte(n.y), signedByte(n.z)};
                               }),
                     folder / "normal.png"));
    VCP_TRY(writePng(pictureOf(maps.size, [&](size_t texel) { return maskColour(maps.states[texel]); }),
                     folder / "mask.png"));
    if (maps.light.empty()) return {};
    return writePng(pictureOf(maps.size,
                              [&](size_t texel) {
                                  const glm::vec3 c = maps.light[texel];
                                  const auto byte = [](float light) { return toByte(linearToSrgb(double(light))); };
                                  return std::array<uint8_t, 3>{byte(c.x), byte(c.y), byte(c.z)};
                              }),
                    folder / "colour.png");
}

std::string sceneText(const BakedMaps& maps) {
    Json surface = {{"asset", "heights.meso"},       {"surface", "base.obj"}, {"tiles", 1},
                    {"offset", maps.heights.offset}, {"filter", false},       {"method", "remesh"}};
    if (!maps.light.empty()) surface["texture"] = "colour.png";
    return Json{{"mesostructure", {surface}}}.dump(2);
}

}  // namespace

Result<uint64_t> writeBaked(const fs::path& folder, const std::string& name, const meso::BaseSurface& base,
                            const meso::TexelMap& map, const BaseFrames& frames, const BakedMaps& maps) {
    meso::BaseSurface mapped = base;
    mapped.uvs = map.tileUvs();
    VCP_TRY(meso::writeBase(folder / "base.obj", mapped, {}));
    meso::Asset asset;
    asset.name = name;
    asset.heights = meso::HeightMap{.size = glm::ivec2(maps.size),
                                    .range = maps.heights.range / meso::tileEdge(mapped),
                                    .texels = maps.heights.values};
    asset.extent = asset.heights->extent();
    VCP_TRY(meso::writeAsset(folder / "heights.meso", asset));
    VCP_TRY(writePictures(folder, maps));
    VCP_TRY_ASSIGN(const std::string glb, glbOf(name, base, frames, maps));
    VCP_TRY(writeFile(folder / "base.glb", OutputKind::Glb, std::as_bytes(std::span(glb))));
    VCP_TRY(writeFile(folder / "scene.json", OutputKind::JsonText, std::string_view(sceneText(maps))));
    uint64_t bytes = 0;
    std::error_code ignored;
    for (const std::string_view file : kBakedFiles)
        if (const uint64_t size = fs::file_size(folder / file, ignored); !ignored) bytes += size;
    return bytes;
}

}  // namespace vcp
