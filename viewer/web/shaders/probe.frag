// Reads the hits of a few pixels: of the middles of the parts into which a grid as large as the target divides them.
precision highp float;
precision highp usampler2D;
uniform usampler2D hitTexels;
uniform vec2 grid;
out uvec4 hit;

void main() { hit = texelFetch(hitTexels, ivec2(gl_FragCoord.xy * vec2(textureSize(hitTexels, 0)) / grid), 0); }
