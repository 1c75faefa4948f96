// What must hold for every mesh file, however hostile: it is read, or refused in one line; what was read keeps
// the contract of MeshStream; and the answer does not depend on how the file was cut into windows.
#pragma once

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "builder/stream/byte_source.h"
#include "builder/stream/mesh_stream.h"
#include "tests/support/piped_bytes.h"

namespace vcp::fuzz {

inline void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "broken: %s\n", what);
    std::abort();
}

inline void requireNormal(uint32_t code) {
    NormalGridPoint point{};
    require(code == kUnknownNormal || (gridPointOf(code, point) && (code & 1u) == 0), "normals are of the grid");
}

struct Outcome {
    std::string error;
    std::vector<glm::dvec3> positions;
    std::vector<Rgba8> colours;
    std::vector<std::array<uint64_t, 3>> triangles;
};

// A small file may show a mesh many times.
constexpr size_t kMostElements = 400'000;

inline Outcome readMesh(Result<std::unique_ptr<MeshStream>> stream) {
    Outcome mesh;
    if (!stream) {
        mesh.error = stream.error().line();
        return mesh;
    }
    MeshChunk chunk;
    while (true) {
        const auto more = (*stream)->next(chunk);
        if (!more) {
            mesh.error = more.error().line();
            return mesh;
        }
        require(*more == (!chunk.positions.empty() || !chunk.triangles.empty()), "an empty chunk ends the mesh");
        if (!*more) break;
        if (mesh.positions.size() + mesh.triangles.size() > kMostElements) {
            mesh.error = "larger than is of use here";
            return mesh;
        }
        require(chunk.uvs.size() == chunk.materials.size() &&
                    (chunk.uvs.empty() || chunk.uvs.size() == chunk.triangles.size()),
                "texture coordinates and a material for each triangle");
        require(chunk.normals.empty() || chunk.normals.size() == chunk.positions.size(), "a normal for each vertex");
        require(chunk.cornerNormals.empty() || chunk.cornerNormals.size() == chunk.triangles.size(),
                "normals for each triangle");
        for (const uint32_t normal : chunk.normals) requireNormal(normal);
        for (const auto& corners : chunk.cornerNormals)
            for (const uint32_t normal : corners) requireNormal(normal);
        for (const uint32_t material : chunk.materials)
            require(material == kNoMaterial || material < (*stream)->materials().size(), "materials are in range");
        require(chunk.positions.size() < 200'000 && chunk.triangles.size() < 2'000'000, "a chunk is bounded");
        mesh.positions.insert(mesh.positions.end(), chunk.positions.begin(), chunk.positions.end());
        mesh.colours.insert(mesh.colours.end(), chunk.colours.begin(), chunk.colours.end());
        mesh.triangles.insert(mesh.triangles.end(), chunk.triangles.begin(), chunk.triangles.end());
    }
    const MeshInfo& info = (*stream)->info();
    require(mesh.colours.size() == (info.hasColour ? mesh.positions.size() : 0), "a colour for each vertex");
    require(!info.vertices || *info.vertices == mesh.positions.size(), "the declared vertices are there");
    for (const glm::dvec3& p : mesh.positions)
        require(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z), "positions are finite");
    for (const auto& triangle : mesh.triangles)
        for (const uint64_t vertex : triangle) require(vertex < mesh.positions.size(), "indices are in range");
    return mesh;
}

using Opener = Result<std::unique_ptr<MeshStream>> (*)(ByteSource);

// `sizeMatters`: whether the size of the file helps to tell what it is.
inline void checkMesh(Opener open, std::string_view bytes, bool sizeMatters = false) {
    const Outcome whole = readMesh(open(ByteSource::fromMemory(bytes, "fuzz")));
    require(whole.error.find('\n') == std::string::npos, "an error is one line");
    for (const size_t window : {1, 37}) {
        const Outcome cut = readMesh(open(ByteSource::fromMemory(bytes, "fuzz", window)));
        require(cut.error.empty() == whole.error.empty(), "windows do not change the outcome");
        if (!whole.error.empty()) continue;
        require(cut.positions == whole.positions, "windows do not change positions");
        require(cut.colours == whole.colours, "windows do not change colours");
        require(cut.triangles == whole.triangles, "windows do not change triangles");
    }
    if (!sizeMatters && compressionOf(bytes) == Compression::None) {
        const Outcome piped = readMesh(open(*test::piped(bytes, 11, 64)));
        require(piped.error.empty() == whole.error.empty(), "a pipe does not change the outcome");
        require(!whole.error.empty() || (piped.positions == whole.positions && piped.triangles == whole.triangles),
                "nor the mesh");
    }
}

}  // namespace vcp::fuzz
