#include "viewer/web/wasm/tile_source.h"

#include <fmt/format.h>

#include "octree/image/jpeg_tile.h"
#include "octree/io/content_hash.h"
#include "viewer/web/wasm/jpeg_tiles.h"

namespace vcp {

Result<PageBytes> TileSource::read(Request request, bool withColour) const {
    if (request.kind != Request::Kind::ImagePiece) return file_.read(request, withColour);
    VCP_TRY_ASSIGN(const auto images, file_.images());
    const ImagePiece piece = images->piece(request.number);
    VCP_TRY(awaitJpegs(*images, piece));
    auto read = file_.read(request, withColour);
    const std::vector<TileRow>& tiles = images->tables().tiles;
    for (uint64_t i = 0; read && i < piece.tiles; ++i) jpegTiles().forget(tiles[piece.firstTile + i].hash);
    return read;
}

Result<void> TileSource::awaitJpegs(const ImagePieces& images, const ImagePiece& piece) const {
    const ImageTables& tables = images.tables();
    if (tables.images[piece.image].coding != kMixedTiles) return {};
    VCP_TRY_ASSIGN(const auto stored, readTiles(*reader_, tables, piece.firstTile, piece.tiles));
    bool isWhole = true;
    for (uint64_t i = 0; i < piece.tiles; ++i) {
        const TileRow& row = tables.tiles[piece.firstTile + i];
        const auto bytes = std::span(stored.bytes).subspan(row.offset - images.extentOf(piece).begin, row.storedBytes);
        // Bytes that are wrong are read, and found to be, as those of other tiles are.
        if (!isJpeg(bytes) || hashBytes(bytes) != row.hash) continue;
        const JpegTiles::State state = jpegTiles().state(row.hash, bytes, images.placeOf(piece, i).size);
        if (state == JpegTiles::State::Failed)
            return brokenBytes(reader_->name(), fmt::format("tile {}", piece.firstTile + i), row.offset,
                               "is a JPEG that the browser does not decode");
        isWhole = isWhole && state == JpegTiles::State::Decoded;
    }
    if (isWhole) return {};
    return Error::cancelled(reader_->name());
}

}  // namespace vcp
