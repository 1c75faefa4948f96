// Shows a picture of words: the canvas has its first row at the bottom.
precision highp float;
precision highp int;
precision highp usampler2D;
uniform usampler2D shownTexels;
uniform ivec2 size;
out vec4 colour;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uint word = texelFetch(shownTexels, ivec2(pixel.x, size.y - 1 - pixel.y), 0).x;
    colour = vec4(word & 255u, word >> 8 & 255u, word >> 16 & 255u, word >> 24) / 255.0;
}
