// Says which piece a patch is: gl_PrimitiveID begins anew within long draws on lavapipe.
#version 450

layout(location = 0) out uint piece;

void main() {
    piece = uint(gl_VertexIndex) / 3u;
    gl_Position = vec4(0.0);
}
