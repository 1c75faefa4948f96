// The colours of counts, in shade.comp and meso_shade.comp.

// Maps 0 to 1 from blue through green to red.
vec3 heat(float x) { return clamp(vec3(3.0 * x - 1.2, 1.5 - abs(3.0 * x - 1.2), 1.4 - 3.0 * x), 0.0, 1.0); }
