// What shell_cast.h computes with. Compiles as GLSL and as C++ (render/host/shell_caster.h).

// Pieces are met a little wider than they are, in weights of their corners, so that no rounding opens a gap between
// two; what is met twice is the same surface. By at least kPieceSlack, ten times what single precision loses over a
// picture of some thousand pieces, and by kRounding of the products that a weight is the sum of: small pieces far from
// the origin lose more.
const float kPieceSlack = 2e-5f, kRounding = 4e-7f;
// A ray looks at no more nodes and pieces, and makes no more iterations in all its pieces; then it is unresolved, with
// what it found. A ray along a base of five million triangles, 1600 quads across, passes a tenth of that.
const uint kMostVisits = 65536u;
// A ray that begins in a section plane meets what is solid there in the piece that it begins in, or comes into within
// this part of a pixel.
const float kCutSlack = 0.05f;
const float kLeastSlope = 1.0f / 16.0f;  // least slope of a ray to the slab: below it, textures are not blurred further
// Pixels that a tile may be wide, over those that the surface may stray: docs/mesostructure.md has the measurement.
const float kFarTile = 8.0f;

// What a ray hit in a shell.
struct ShellHit {
    float t;      // along the ray; kMesoNoHit
    vec3 normal;  // not unit
    uint iterations;
    bool unresolved;
    int piece;  // first texel of its piece
    bool far;   // not marched: normal and light come from the appearance
    bool cut;   // of a border or a section plane: what is shown lies within the solid
    bool base;  // the base itself
    // When the ray that hit came into the shell, where the map is asked once for all of its way through it;
    // kMesoNoHit for other hits, which lie where they are found.
    float asked;
    float border;  // when the ray first leaves such a shell by its border; kMesoNoHit
};

// Where a ray passes a piece; times count from a point of the ray where numbers are small.
struct ShellPassage {
    int at;  // texel of the piece
    float enter, leave;
    float early, late;  // by how much it is met before it and after it, for it is met a little wider than it is
    int entered;        // the corner opposite to the face that it comes in by; -1: it starts within
    int left;           // that opposite to the face that it leaves by; -1: it ends within
    bool toBase;
};

// How a hit looks. What is seen from far stands for many points: the light that arrives is their mean, and so is the
// part of the sky that they face; elsewhere both follow from the normal.
struct ShellLook {
    vec3 colour;  // encoded for the screen
    float sky;    // from far, 0 to kMesoMostSky; else 1
    vec4 light;   // of each light: from far, what it gives; else how much of it is seen
};
const float kMesoMostSky = 254.0f / 255.0f;

// The part of a ray that section planes leave.
struct ShellKept {
    float first, last;
};

// The nine coefficients and the mean normal of a view of the grid of an appearance.
struct FarView {
    vec4 a, b, c;
};
