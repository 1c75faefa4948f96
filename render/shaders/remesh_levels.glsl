// The levels of heights, which are in tiles (mesostructure/shared/remesh_layout.h). Whoever includes this has
//   uvec4 fetchHeightQuad(int i)     the i-th quad of the levels
//   void markHeightTile(int entry)   says that the picture reads the tile of an entry
//   const uint kAllTiles             1: all tiles are there, and none is marked
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

// Returns where the entry of a texel's tile is.
int entryOf(RemeshLevel level, ivec2 at) {
    int tiles = (level.size.x + kRemeshTileEdge - 1) >> kRemeshTileShift;
    return level.firstEntry + (at.y >> kRemeshTileShift) * tiles + (at.x >> kRemeshTileShift);
}

uint fetchEntry(int entry) { return fetchHeightQuad(entry >> 2)[entry & 3]; }

int remeshWrapped(float x, int n);

// No branch: software devices go through both sides of one.
RemeshLevel remeshThere(RemeshLevel level, vec2 at) {
    if (kAllTiles != 0u) return level;
    vec2 texel = floor(at * level.texels);
    int entry = entryOf(level, ivec2(remeshWrapped(texel.x, level.size.x), remeshWrapped(texel.y, level.size.y)));
    markHeightTile(entry);
    return remeshLevel(int(fetchEntry(entry) >> kRemeshQuadBits));
}

uvec4 remeshTexels(RemeshLevel level, ivec2 at) {
    int quad = int(fetchEntry(entryOf(level, at)) & ((1u << kRemeshQuadBits) - 1u)), row = kRemeshTileEdge + 1;
    int i = (at.y & (kRemeshTileEdge - 1)) * row + (at.x & (kRemeshTileEdge - 1));
    return uvec4(heightAt(quad, i), heightAt(quad, i + 1), heightAt(quad, i + row), heightAt(quad, i + row + 1));
}
