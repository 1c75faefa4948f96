// The procedural dog: a smooth body with texture coordinates, to lay mesostructure on.
//
// Metres, y up, standing on y = 0 and facing +z, about 1.1 m high: tapered limbs, blended (Quilez's polynomial minimum)
// and meshed by surface nets (Gibson 1998), closed. A triangle is mapped round the axis of the limb that it is nearest
// to, or flat over the limb's end: charts that are cut between limbs. One unit of the coordinates is a tenth of a
// metre, more or less as a limb is thinner or thicker than on average; round a limb there are whole units, so what has
// whole tiles a unit closes there.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "octree/io/result.h"

namespace vcp::scan {

struct DogMesh {
    std::vector<glm::dvec3> positions;
    std::vector<std::array<uint32_t, 3>> triangles;  ///< counter-clockwise from outside
    std::vector<std::array<glm::dvec2, 3>> uvs;      ///< of the triangles' corners
};

constexpr uint64_t kMostDogTriangles = 200'000;

/// Makes a dog of about so many triangles, within a tenth: 10 thousand to kMostDogTriangles.
DogMesh dog(uint64_t triangles);

/// Hands the v, vt and f of an OBJ to `write` in pieces; returns its first error.
Result<void> writeObj(const DogMesh& mesh, const std::function<Result<void>(std::string_view)>& write);

}  // namespace vcp::scan
