#include "octree/image/image_assembly.h"

#include <algorithm>
#include <utility>

namespace vcp {

void ImageAssembly::take(uint64_t number, std::span<const uint32_t> texels) {
    if (has_[number]) return;
    has_[number] = true;
    const ImagePiece piece = pieces_->piece(number);
    for (uint64_t i = 0; i < piece.tiles; ++i) {
        const ImagePieces::TilePlace place = pieces_->placeOf(piece, i);
        const size_t count = size_t{place.size.x} * place.size.y;
        const std::shared_ptr<uint32_t[]> tile(new uint32_t[count]);
        std::copy_n(texels.begin(), count, tile.get());
        set_.set(piece.image, place.level, place.tile, tile);
        texels = texels.subspan(count);
    }
}

void ImageAssembly::drop(uint64_t number) {
    if (!has_[number]) return;
    has_[number] = false;
    const ImagePiece piece = pieces_->piece(number);
    for (uint64_t i = 0; i < piece.tiles; ++i) {
        const ImagePieces::TilePlace place = pieces_->placeOf(piece, i);
        set_.set(piece.image, place.level, place.tile, nullptr);
    }
}

Result<ImageSet> readAllImages(const ByteReader& reader, std::shared_ptr<const ImagePieces> pieces) {
    ImageAssembly assembly(std::move(pieces));
    for (uint64_t piece = 0; piece < assembly.pieces().count(); ++piece) {
        VCP_TRY_ASSIGN(const auto texels, assembly.pieces().readPiece(reader, piece));
        assembly.take(piece, texels);
    }
    return assembly.set();
}

Result<ImageSet> readAllImages(const ByteReader& reader, const ImagesPlace& place) {
    VCP_TRY_ASSIGN(auto pieces, ImagePieces::read(reader, place));
    return readAllImages(reader, std::move(pieces));
}

}  // namespace vcp
