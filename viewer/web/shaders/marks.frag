precision highp float;
precision highp int;
out uint mark;

void main() { mark = 1u; }
