#include "octree/image/image_assembly.h"

#include <algorithm>

namespace vcp {

bool ImageAssembly::has(uint64_t number) const {
    const ImagePiece piece = pieces_->piece(number);
    if (set_.images()[piece.image].finest <= piece.level) return true;
    const auto begun = begun_.find({piece.image, piece.level});
    return begun != begun_.end() && begun->second.has[number - pieces_->piecesOf(piece.image, piece.level).first];
}

/// Copies a tile from the front of `texels` into its level, and takes it off.
void ImageAssembly::copyTile(const ImageLevel& level, uint64_t tile, std::span<const uint32_t>& texels,
                             uint32_t* to) const {
    const glm::uvec2 place = pieces_->placeOf(tile), size = level.sizeOf(place);
    for (uint32_t y = 0; y < size.y; ++y) {
        const uint64_t row = uint64_t{place.y} * level.tileEdge + y;
        std::copy_n(texels.begin(), size.x, to + row * level.width + uint64_t{place.x} * level.tileEdge);
        texels = texels.subspan(size.x);
    }
}

void ImageAssembly::takeFirst(const ImagePiece& piece, std::span<const uint32_t> texels) {
    const std::vector<ImageLevel>& levels = pieces_->levelsOf(piece.image);
    for (size_t level = levels.size(); level-- > piece.level;) {
        const std::shared_ptr<uint32_t[]> to(new uint32_t[levels[level].texels()]);
        copyTile(levels[level], levels[level].firstTile, texels, to.get());
        set_.add(piece.image, {levels[level].width, levels[level].height, to});
    }
}

void ImageAssembly::take(uint64_t number, std::span<const uint32_t> texels) {
    if (has(number)) return;
    const ImagePiece piece = pieces_->piece(number);
    if (piece.level == pieces_->firstLevel(piece.image)) {
        // Some of its levels may be there, where finer ones were dropped.
        set_.drop(piece.image, uint32_t(pieces_->levelsOf(piece.image).size()));
        takeFirst(piece, texels);
    } else {
        const ImageLevel& level = pieces_->levelsOf(piece.image)[piece.level];
        const auto [first, end] = pieces_->piecesOf(piece.image, piece.level);
        Begun& begun = begun_[{piece.image, piece.level}];
        if (!begun.texels) {
            begun.texels.reset(new uint32_t[level.texels()]);
            begun.has.assign(end - first, false);
            begun.missing = end - first;
        }
        for (uint64_t tile = piece.firstTile; tile < piece.firstTile + piece.tiles; ++tile)
            copyTile(level, tile, texels, begun.texels.get());
        begun.has[number - first] = true;
        --begun.missing;
    }
    addWhole(piece.image);
}

/// Adds the levels of an image that are whole now.
void ImageAssembly::addWhole(uint32_t image) {
    while (set_.images()[image].finest > 0) {
        const uint32_t next = set_.images()[image].finest - 1;
        const auto begun = begun_.find({image, next});
        if (begun == begun_.end() || begun->second.missing > 0) return;
        const ImageLevel& level = pieces_->levelsOf(image)[next];
        set_.add(image, {level.width, level.height, std::move(begun->second.texels)});
        begun_.erase(begun);
    }
}

void ImageAssembly::drop(uint32_t image, uint32_t finest) {
    set_.drop(image, finest);
    begun_.erase(begun_.lower_bound({image, 0}), begun_.lower_bound({image, finest}));
}

}  // namespace vcp
