#include "render/pages/image_words.h"

#include <bit>

namespace vcp {

namespace {

/// Where the words of images stand: those that all sets of a file share, which the texels follow.
struct Layout {
    explicit Layout(const ImageSet& set) : tables(uint32_t(4 + 4 * set.materials().size())) {
        for (uint32_t i = 0; i < set.materials().size(); ++i) {
            const bool hasChannels = set.channelsOf(i) != nullptr;
            channels.push_back(hasChannels ? tables : 0);
            tables += hasChannels ? 12 : 0;
        }
        for (const ImageSet::Image& image : set.images()) {
            images.push_back(tables);
            tables += uint32_t(4 + 4 * image.levels.size());
        }
        for (const ImageSet::Image& image : set.images())
            for (const ImageSet::Level& level : image.levels) {
                tiles.push_back(tables);
                tables += uint32_t(level.tiles.size());
            }
    }

    std::vector<uint32_t> channels;  // word of each material's channels, 0 where it has none
    std::vector<uint32_t> images;    // word of each image
    std::vector<uint32_t> tiles;     // of the first tile of each level, image by image
    uint32_t tables;                 // how many words there are before the texels
};

void addChannels(const ChannelRow& row, const Layout& layout, std::vector<uint32_t>& words) {
    const auto imageOf = [&](uint32_t number) { return number != 0 ? layout.images[number - 1] : 0; };
    const auto bits = [](float number) { return std::bit_cast<uint32_t>(number); };
    words.insert(words.end(), {imageOf(row.normals), imageOf(row.surface), imageOf(row.emission), bits(row.normalScale),
                               bits(row.roughness), bits(row.metalness), 0, 0, bits(row.emissionFactor[0]),
                               bits(row.emissionFactor[1]), bits(row.emissionFactor[2]), 0});
}

}  // namespace

ImageWords imageWords(const ImageSet& set) {
    const Layout layout(set);
    ImageWords made;
    std::vector<uint32_t>& words = made.tables;
    words = {uint32_t(set.materials().size()), 0, 0, 0};
    for (size_t i = 0; i < set.materials().size(); ++i) {
        const MaterialRow& material = set.materials()[i];
        words.insert(words.end(),
                     {set.images()[material.image].isShown() ? layout.images[material.image] : 0, material.factor,
                      uint32_t(material.wrapU) | uint32_t(material.wrapV) << 8, layout.channels[i]});
    }
    for (uint32_t i = 0; i < set.materials().size(); ++i)
        if (const ChannelRow* const row = set.channelsOf(i)) addChannels(*row, layout, words);
    size_t number = 0;
    for (const ImageSet::Image& image : set.images()) {
        words.insert(words.end(), {image.width, image.height, image.finest, uint32_t(image.levels.size())});
        for (const ImageSet::Level& level : image.levels)
            words.insert(words.end(), {level.width, level.height, layout.tiles[number++], level.log2Edge});
    }
    uint64_t end = layout.tables;
    for (const ImageSet::Image& image : set.images())
        for (const ImageSet::Level& level : image.levels)
            for (size_t i = 0; i < level.tiles.size(); ++i) {
                const uint64_t texels = level.tiles[i] ? level.texelsOf(i) : 0;
                words.push_back(texels > 0 ? uint32_t(end) : 0);
                if (texels > 0) made.texels.emplace_back(level.tiles[i].get(), texels);
                end += texels;
            }
    return made;
}

}  // namespace vcp
