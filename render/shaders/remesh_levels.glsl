// The levels of heights, which are in tiles (mesostructure/shared/remesh_layout.h). Whoever includes this has
//   uvec4 fetchHeightQuad(int i)     the i-th quad of the levels
//   void markHeightTile(int entry)   says that the picture reads the tile of an entry
struct RemeshLevel {
    ivec2 size;
    vec2 texels;
    int number, firstEntry;
};

RemeshLevel remeshLevel(int number) {
    uvec4 stored = fetchHeightQuad(number);
    return RemeshLevel(ivec2(stored.yz), vec2(float(stored.y), uintBitsToFloat(stored.w)), number, int(stored.x));
}

uint heightAt(int quad, int i) {
    uint word = fetchHeightQuad(quad + (i >> 3))[i >> 1 & 3];
    return word >> uint((i & 1) << 4) & 0xffffu;
}

// Returns the heights at a texel of a tile and after it.
uvec4 heightsOf(uint entry, ivec2 at) {
    int quad = int(entry & ((1u << kRemeshQuadBits) - 1u)), row = kRemeshTileEdge + 1;
    int i = at.y % kRemeshTileEdge * row + at.x % kRemeshTileEdge;
    return uvec4(heightAt(quad, i), heightAt(quad, i + 1), heightAt(quad, i + row), heightAt(quad, i + row + 1));
}

int entryOf(RemeshLevel level, ivec2 at) {
    ivec2 tile = at / kRemeshTileEdge;
    return level.firstEntry + tile.y * ((level.size.x + kRemeshTileEdge - 1) / kRemeshTileEdge) + tile.x;
}

uint fetchEntry(int entry) { return fetchHeightQuad(entry >> 2)[entry & 3]; }

// Returns what a coarser level has at a texel: bilinear, in whole numbers, so that all devices agree.
uint coarserHeight(RemeshLevel level, RemeshLevel coarser, ivec2 at) {
    uvec2 size = uvec2(level.size), scaled = uvec2(at) * uvec2(coarser.size), part = scaled % size;
    ivec2 from = ivec2(scaled / size);
    uvec4 texels = heightsOf(fetchEntry(entryOf(coarser, from)), from);
    uvec2 along = (texels.xz * (size.x - part.x) + texels.yw * part.x) / size.x;
    return (along.x * (size.y - part.y) + along.y * part.y) / size.y;
}

uvec4 remeshTexels(RemeshLevel level, ivec2 at) {
    int number = entryOf(level, at);
    uint entry = fetchEntry(number);
    int has = int(entry >> kRemeshQuadBits);
    markHeightTile(number);
    if (has == level.number) return heightsOf(entry, at);
    RemeshLevel coarser = remeshLevel(has);
    ivec2 after = ivec2(at.x + 1 < level.size.x ? at.x + 1 : 0, at.y + 1 < level.size.y ? at.y + 1 : 0);
    return uvec4(coarserHeight(level, coarser, at), coarserHeight(level, coarser, ivec2(after.x, at.y)),
                 coarserHeight(level, coarser, ivec2(at.x, after.y)), coarserHeight(level, coarser, after));
}
