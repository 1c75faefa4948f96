// The maths of remeshing as GLSL.
#define INLINE
#define CONST_REF(T) T
#define CONSTANT const
#define PRECISE precise
#define Real float
#define Real2 vec2
#define Real3 vec3
#include "mesostructure/shared/remesh_layout.h"
#include "mesostructure/shared/remesh_math.h"
