// Reads the hits of a few pixels: of the middles of the parts into which a grid as large as the target divides them.
precision highp float;
precision highp int;
precision highp usampler2D;
uniform usampler2D hitTexels;
uniform ivec2 grid, size;  // of the target, of the picture
out uvec4 hit;

void main() {
    hit = texelFetch(hitTexels, (2 * ivec2(gl_FragCoord.xy) + 1) * size / (2 * grid), 0);
}
