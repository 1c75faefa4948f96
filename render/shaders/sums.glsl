// The sums of a picture's samples, and what is shown of them (accumulate.comp).
layout(set = 0, binding = 13, std430) readonly buffer PartPictureBlock { uint partPixels[]; };
layout(set = 0, binding = 18, std430) buffer SumBlock { vec4 sums[]; };
layout(set = 0, binding = 19, std430) buffer ShownPictureBlock { uint shownPixels[]; };

uint fetchPart(uint i) { return partPixels[i]; }
vec4 fetchSum(uint i) { return sums[i]; }
uint fetchShown(uint i) { return shownPixels[i]; }
void storeSum(uint i, vec4 sum) { sums[i] = sum; }
void storeShown(uint i, uint colour) { shownPixels[i] = colour; }
