// Gives the triangles of a mesh what is known of their places in images.
#pragma once

#include <vector>

#include "builder/lattice/lattice_mesh.h"

namespace vcp {

/// Fills mesh.textures. `known`: in any order, of triangles of the mesh on its deepest lattice, and of others; of
/// several for one triangle the least counts, so that their order does not matter. A triangle that nothing is known of
/// gets none. Uses the calling arena's threads.
void addTextures(LatticeMesh& mesh, std::vector<TexturedTriangle> known);

}  // namespace vcp
