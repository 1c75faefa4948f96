// Normals of a mesh as the product has them, made independently of it.
#pragma once

#include <vector>

#include <glm/vec3.hpp>

#include "builder/measure/indexed_mesh.h"

namespace vcp {

/// Returns the shading normal of each corner of each triangle, three a triangle: unit, or 0 where there is none. They
/// are the means, weighted by area, of the triangles about a vertex, found by its position; across creases a triangle
/// keeps its own (mesh_picture.h). Normals that the mesh has count in place of these.
std::vector<glm::vec3> shadingNormals(const IndexedMesh& mesh);

}  // namespace vcp
