// Where a volume of transfer lies among a surface's looks (transfer_lookup.h). Compiles as C++ and as GLSL.
struct MesoTransfer {
    uint first;             // texel
    uint across, back, up;  // cells along x, y, z; 0: there is none
};

const uint kTransferTexels = 17u;  // of a cell, four values each: four terms, and the mean normal with its length
// Numbers of cells are kept as two halves, which hold whole numbers up to this.
const uint kTransferHalf = 2048u;
// What a cell counts at least, however unlike its normals are.
const float kLeastLikeness = 1e-3f;
