// Which pixel an invocation works on. 64 invocations a tile; eight consecutive ones, which software devices
// run together, make a block of 4 x 2 pixels: their rays stay together longer than those of a row.

uvec2 pixelInTile() {
    uint i = gl_LocalInvocationIndex;
    return uvec2((i & 3u) | (i >> 1 & 4u), (i >> 2 & 1u) | (i >> 3 & 6u));
}

// Software devices give each thread an equal run of consecutive workgroups: neighbours in the list go to
// different threads, so that all have the same share of sky and statue.
uint stripedIndex(uint i, uint count) {
    uint stripes = frame.mode.z;
    uint run = count / stripes;
    return i < run * stripes ? (i % run) * stripes + i / run : i;
}
