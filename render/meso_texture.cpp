#include "render/meso_texture.h"

#include <algorithm>
#include <array>

#include <glm/common.hpp>
#include <glm/gtc/packing.hpp>

namespace vcp {

namespace {

/// Which finer texels one texel of half as many covers: three at most, by parts that add up to 1.
struct Cover {
    uint32_t first = 0;
    std::array<float, 3> parts{};
};

Cover coverOf(uint32_t coarse, uint32_t coarseSize, uint32_t size) {
    const double step = double(size) / coarseSize, begin = coarse * step, end = begin + step;
    Cover cover{std::min(uint32_t(begin), size - 1), {}};
    for (uint32_t i = 0; i < 3 && cover.first + i < size; ++i)
        cover.parts[i] =
            float(std::max(0.0, std::min(end, double(cover.first) + i + 1) - std::max(begin, double(cover.first) + i)) /
                  step);
    return cover;
}

std::vector<glm::vec4> halved(const std::vector<glm::vec4>& fine, glm::uvec2 size, glm::uvec2 coarse) {
    std::vector<glm::vec4> made;
    made.reserve(size_t{coarse.x} * coarse.y);
    for (uint32_t y = 0; y < coarse.y; ++y) {
        const Cover rows = coverOf(y, coarse.y, size.y);
        for (uint32_t x = 0; x < coarse.x; ++x) {
            const Cover columns = coverOf(x, coarse.x, size.x);
            glm::vec4 sum(0);
            for (uint32_t j = 0; j < 3; ++j)
                for (uint32_t i = 0; i < 3; ++i)
                    if (const float part = rows.parts[j] * columns.parts[i]; part > 0)
                        sum += part * fine[size_t{rows.first + j} * size.x + columns.first + i];
            made.push_back(sum);
        }
    }
    return made;
}

}  // namespace

MesoTexture makeMesoTexture(glm::uvec2 size, std::vector<glm::vec4> texels) {
    MesoTexture made{size, 0, {}};
    while (true) {
        for (const glm::vec4& texel : texels) made.texels.push_back(glm::packHalf4x16(texel));
        ++made.levels;
        if (size == glm::uvec2(1)) return made;
        const glm::uvec2 coarse = glm::max(size / 2u, glm::uvec2(1));
        texels = halved(texels, size, coarse);
        size = coarse;
    }
}

}  // namespace vcp
