// Reads whole small meshes for the tests of the mesh readers.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "builder/mesh/open_mesh.h"
#include "builder/stream/byte_source.h"
#include "tests/support/piped_bytes.h"

namespace vcp::test {

/// The folder of models that are not part of the repository; it need not be there.
inline const std::filesystem::path kSharedData = VCP_SHARED_DATA_DIR;

using Triangle = std::array<uint64_t, 3>;

struct ReadMesh {
    std::vector<glm::dvec3> positions;
    std::vector<Rgba8> colours;
    std::vector<uint32_t> normals;  // none, or of all vertices
    std::vector<Triangle> triangles;
    std::vector<std::array<uint32_t, 3>> cornerNormals;  // of all triangles
    MeshInfo info;
    std::optional<Error> error;

    bool operator==(const ReadMesh& other) const {
        return positions == other.positions && colours == other.colours && normals == other.normals &&
               triangles == other.triangles && cornerNormals == other.cornerNormals &&
               error.has_value() == other.error.has_value();
    }
    [[nodiscard]] std::string line() const { return error ? error->line() : ""; }
};

// Checks on the way what holds for every chunk of every mesh.
inline ReadMesh readAll(Result<std::unique_ptr<MeshStream>> stream) {
    ReadMesh mesh;
    if (!stream) {
        mesh.error = stream.error();
        return mesh;
    }
    mesh.info = (*stream)->info();
    MeshChunk chunk;
    uint64_t bytesBefore = 0;
    while (true) {
        const auto more = (*stream)->next(chunk);
        if (!more) {
            mesh.error = more.error();
            return mesh;
        }
        EXPECT_EQ(*more, !chunk.positions.empty() || !chunk.triangles.empty());
        EXPECT_TRUE(chunk.colours.empty() || chunk.colours.size() == chunk.positions.size());
        EXPECT_TRUE(chunk.normals.empty() || chunk.normals.size() == chunk.positions.size());
        EXPECT_TRUE(chunk.cornerNormals.empty() || chunk.cornerNormals.size() == chunk.triangles.size());
        EXPECT_GE((*stream)->bytesRead(), bytesBefore);
        if (mesh.info.fileBytes > 0) {
            EXPECT_LE((*stream)->bytesRead(), mesh.info.fileBytes);
        }
        if (!*more) break;
        bytesBefore = (*stream)->bytesRead();
        mesh.positions.insert(mesh.positions.end(), chunk.positions.begin(), chunk.positions.end());
        mesh.colours.insert(mesh.colours.end(), chunk.colours.begin(), chunk.colours.end());
        mesh.normals.insert(mesh.normals.end(), chunk.normals.begin(), chunk.normals.end());
        mesh.triangles.insert(mesh.triangles.end(), chunk.triangles.begin(), chunk.triangles.end());
        mesh.cornerNormals.insert(mesh.cornerNormals.end(), chunk.cornerNormals.begin(), chunk.cornerNormals.end());
        mesh.cornerNormals.resize(mesh.triangles.size(), {kUnknownNormal, kUnknownNormal, kUnknownNormal});
    }
    EXPECT_EQ(mesh.colours.size(), mesh.info.hasColour ? mesh.positions.size() : 0);
    if (mesh.info.vertices) {
        EXPECT_EQ(mesh.positions.size(), *mesh.info.vertices);
    }
    for (const Triangle& triangle : mesh.triangles)
        for (const uint64_t vertex : triangle) EXPECT_LT(vertex, mesh.positions.size());
    return mesh;
}

using Opener = Result<std::unique_ptr<MeshStream>> (*)(ByteSource);

// Reads `bytes` through windows that cut every item somewhere; all must tell the same.
inline ReadMesh readEveryWindow(Opener open, std::string_view bytes) {
    const ReadMesh whole = readAll(open(ByteSource::fromMemory(bytes, "mesh")));
    for (const size_t window : {1, 2, 3, 7, 16, 61, 256}) {
        const ReadMesh cut = readAll(open(ByteSource::fromMemory(bytes, "mesh", window)));
        EXPECT_EQ(cut.line(), whole.line()) << "window " << window;
        EXPECT_TRUE(cut.error || cut == whole) << "window " << window;
        // Through a pipe a wrong count is found later, at the end instead of in the header.
        const ReadMesh piped = readAll(open(*test::piped(bytes, window, window)));
        EXPECT_EQ(piped.error.has_value(), whole.error.has_value())
            << "piped " << window << ": " << piped.line() << whole.line();
        EXPECT_TRUE(piped.error || piped == whole) << "piped " << window;
    }
    return whole;
}

}  // namespace vcp::test
