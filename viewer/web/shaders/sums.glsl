// The sums of a picture's samples in textures: what was shown before, the sums before, and the sample to add.
uniform usampler2D sumTexels;  // bits of floats
uniform usampler2D shownTexels;
uniform usampler2D partTexels;
vec4 storedSum = vec4(0.0);
uint storedShown = 0u;

ivec2 pixelAt(uint i) { return ivec2(i % frame.width, i / frame.width); }

uint fetchPart(uint i) { return texelFetch(partTexels, pixelAt(i), 0).x; }
vec4 fetchSum(uint i) { return uintBitsToFloat(texelFetch(sumTexels, pixelAt(i), 0)); }
uint fetchShown(uint i) { return texelFetch(shownTexels, pixelAt(i), 0).x; }
void storeSum(uint i, vec4 sum) { storedSum = sum; }
void storeShown(uint i, uint colour) { storedShown = colour; }
