#include "viewer/scene/tile_texture.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "builder/stream/colour_encoding.h"
#include "builder/texture/image.h"

namespace vcp {

namespace {

constexpr uint32_t kMostEdge = 4096;

/// Returns a channel of a texel that is stored as 8 bits.
int byteOf(Rgba8 texel, int channel) { return int(texel >> (8 * channel) & 0xff); }

template <class ToVector>
Result<MesoTexture> readTexture(const std::filesystem::path& path, ToVector toVector) {
    VCP_TRY_ASSIGN(const auto image, loadImage({.path = path, .bytes = nullptr}, {.edge = kMostEdge}));
    std::vector<glm::vec4> texels;
    texels.reserve(image.texels.size());
    for (uint32_t y = image.height; y-- > 0;)
        for (uint32_t x = 0; x < image.width; ++x)
            texels.push_back(toVector(image.texels[size_t{y} * image.width + x]));
    return makeMesoTexture({image.width, image.height}, std::move(texels));
}

}  // namespace

Result<MesoTexture> readColourTexture(const std::filesystem::path& path) {
    return readTexture(path, [&table = lightOfByte()](Rgba8 texel) {
        const auto light = [&](int channel) { return float(table[size_t(byteOf(texel, channel))]); };
        return glm::vec4(light(0), light(1), light(2), 1);
    });
}

Result<MesoTexture> readNormalTexture(const std::filesystem::path& path) {
    return readTexture(path, [](Rgba8 texel) {
        // 128 stands for 0, as exactly as bytes allow.
        const glm::vec3 n = (glm::vec3(byteOf(texel, 0), byteOf(texel, 1), byteOf(texel, 2)) - 128.0f) / 127.0f;
        return n.z > 0 ? glm::vec4(glm::normalize(n), 0) : glm::vec4(0, 0, 1, 0);
    });
}

}  // namespace vcp
