// Marks the page that each pixel's ray hit: a point at the place of its record, 1024 to a row.
precision highp float;
precision highp usampler2D;
uniform usampler2D hitTexels;
uniform vec2 size;  // of the target
uniform int width;  // of the picture

void main() {
    uint mark = texelFetch(hitTexels, ivec2(gl_VertexID % width, gl_VertexID / width), 0).w;
    vec2 place = vec2(float(mark - 1u & 1023u), float(mark - 1u >> 10)) + 0.5;
    gl_Position = mark == 0u ? vec4(2.0, 2.0, 2.0, 1.0) : vec4(place / size * 2.0 - 1.0, 0.0, 1.0);
    gl_PointSize = 1.0;
}
