// How a volume of transfer is read (transfer_lookup.h). Compiles as C++ and as GLSL.
const uint kTransferTexels = 17u;  // of a cell, four values each: four terms, and the mean normal with its length
// Of a vertex' light (mesostructure/base_transfer.h): 16 coefficients of red, then of green and of blue.
const uint kBaseLightTexels = 12u;
// Numbers of cells are kept as two halves, which hold whole numbers up to this.
const uint kTransferHalf = 2048u;
// What a cell counts at least, however unlike its normals are.
const float kLeastLikeness = 1e-3f;
