// Which pixel an invocation works on. 64 invocations a tile; eight consecutive ones, which software devices
// run together, make a block of 4 x 2 pixels: their rays stay together longer than those of a row.

uvec2 pixelInTile() {
    uint i = gl_LocalInvocationIndex;
    return uvec2((i & 3u) | (i >> 1 & 4u), (i >> 2 & 1u) | (i >> 3 & 6u));
}

// Software devices give each thread an equal run of consecutive workgroups: neighbours in the list go to
// different threads, so that all have the same share of sky and statue. They divide integers one by one: in
// floats the quotient is as exact, below 2^23.
uint quotient(uint a, uint b) { return uint((float(a) + 0.5) / float(b)); }

uint stripedIndex(uint i, uint count) {
    uint stripes = frame.stripes;
    uint run = quotient(count, stripes);
    uint stripe = quotient(i, max(run, 1u));
    return i < run * stripes ? (i - stripe * run) * stripes + stripe : i;
}

// The place of an invocation in a grid over all tiles, or all pixels; the grid may be larger.
uvec2 ownPlace() { return gl_GlobalInvocationID.xy; }

// Finds the invocation's pixel among those of all tiles; false where there is none.
bool anyPixel(out uvec2 pixel) {
    uint index = gl_WorkGroupID.y * kTileRow + gl_WorkGroupID.x;
    uint count = frame.tilesX * frame.tilesY;
    pixel = uvec2(0u);
    if (index >= count) return false;
    uint tile = stripedIndex(index, count), row = quotient(tile, frame.tilesX);
    pixel = uvec2(tile - row * frame.tilesX, row) * kTileSize + pixelInTile();
    return all(lessThan(pixel, pictureSize()));
}

// Finds the invocation's tile of the list and its pixel; false where there is none.
bool listedPixel(out uint tile, out uvec2 pixel) {
    uint index = gl_WorkGroupID.y * kTileRow + gl_WorkGroupID.x;
    uint count = fetchTileList(3u);
    tile = 0u;
    pixel = uvec2(0u);
    if (index >= count) return false;
    uint packed = fetchTileList(kTileListHeader + stripedIndex(index, count));
    uvec2 place = uvec2(packed & 0xffffu, packed >> 16);
    tile = place.y * frame.tilesX + place.x;
    pixel = place * kTileSize + pixelInTile();
    return all(lessThan(pixel, pictureSize()));
}
