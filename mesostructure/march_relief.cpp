// Relief mapping of height fields and of layers of solids, and the maximum pyramid.
#include <algorithm>

#include "mesostructure/march_arrays.h"

namespace vcp::meso {

namespace {

MaxPyramid::Level halved(const MaxPyramid::Level& fine) {
    MaxPyramid::Level coarse{(fine.size + 1) / 2, {}};
    coarse.most.resize(size_t(coarse.size.x) * size_t(coarse.size.y));
    for (int y = 0; y < fine.size.y; ++y)
        for (int x = 0; x < fine.size.x; ++x) {
            uint16_t& most = coarse.most[size_t(y / 2) * size_t(coarse.size.x) + size_t(x / 2)];
            most = std::max(most, fine.most[size_t(y) * size_t(fine.size.x) + size_t(x)]);
        }
    return coarse;
}

}  // namespace

MaxPyramid buildMaxPyramid(const HeightMap& map) {
    MaxPyramid pyramid;
    MaxPyramid::Level base{map.size, std::vector<uint16_t>(map.texels.size())};
    for (int y = 0; y < map.size.y; ++y)
        for (int x = 0; x < map.size.x; ++x)
            base.most[size_t(y) * size_t(map.size.x) + size_t(x)] =
                std::max({map.texel(x, y), map.texel(x + 1, y), map.texel(x, y + 1), map.texel(x + 1, y + 1)});
    pyramid.levels.push_back(std::move(base));
    while (pyramid.levels.back().size.x > 1 || pyramid.levels.back().size.y > 1)
        pyramid.levels.push_back(halved(pyramid.levels.back()));
    return pyramid;
}

std::unique_ptr<Marcher> reliefMarcher(const HeightMap& map, const ReliefOptions& options) {
    return arrayMarcher(reliefArrays(map, options), map.texels.size() * 2, false);
}

std::unique_ptr<Marcher> reliefMarcher(const ReliefLayers& layers, const ReliefOptions& options) {
    return arrayMarcher(layeredArrays(layers, options), layers.bytes(), false);
}

std::unique_ptr<Marcher> pyramidMarcher(const HeightMap& map) {
    uint64_t texels = map.texels.size();
    for (const MaxPyramid::Level& level : buildMaxPyramid(map).levels) texels += level.most.size();
    return arrayMarcher(pyramidArrays(map), texels * 2, true);
}

}  // namespace vcp::meso
