// Which pixel a fragment is: rows of pictures begin at the top, at the first row of a texture.

uvec2 ownPlace() { return uvec2(gl_FragCoord.xy); }

// Finds the fragment's pixel and its tile; false where the tile is empty.
bool listedPixel(out uint tile, out uvec2 pixel) {
    pixel = ownPlace();
    tile = pixel.y / kTileSize * frame.tilesX + pixel.x / kTileSize;
    return fetchTileStart(tile) < kTileEmpty;
}
