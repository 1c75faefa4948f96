// What a build shows of what it has read.
#include "builder/mesh_sample.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "builder/build.h"
#include "tests/support/mesh_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

TEST(EvenSample, KeepsEveryNthAndNeverMoreThanItMay) {
    EvenSample<uint64_t> sample(16);
    for (uint64_t i = 0; i < 1000; ++i) {
        if (sample.wantsNext()) sample.keep(i);
        ASSERT_LE(sample.items().size(), 16u);
        ASSERT_EQ(sample.items().size(), i / sample.each() + 1);
        for (size_t k = 0; k < sample.items().size(); ++k) ASSERT_EQ(sample.items()[k], k * sample.each());
    }
    EXPECT_EQ(sample.each(), 128u);
}

TEST(MeshSample, BoundsAreOfAllVerticesAndPlacesOfDoubles) {
    MeshSample sample(4);
    EXPECT_EQ(sample.version(), 0u);
    const glm::dvec3 far(1e9, -1e9, 3);
    std::vector<glm::dvec3> vertices;
    for (int i = 0; i < 9; ++i) vertices.push_back(far + glm::dvec3(0.001 * i, -0.002 * i, 0));
    sample.addVertices(vertices);
    EXPECT_GT(sample.version(), 0u);
    const MeshSample::Snapshot read = sample.snapshot();
    EXPECT_EQ(read.low, glm::dvec3(vertices[0].x, vertices[8].y, 3));
    EXPECT_EQ(read.high, glm::dvec3(vertices[8].x, vertices[0].y, 3));
    ASSERT_EQ(read.vertices.size(), 3u);
    EXPECT_EQ(read.origin, far);
    EXPECT_EQ(read.vertices[1], glm::vec3(vertices[4] - far));
}

TEST(MeshSample, ABuildGivesAllThatItReadsAndWritesTheSameBytes) {
    const TestFolder folder("vcp_mesh_sample_test");
    const IndexedMesh mesh = test::torusMesh({1, 2, 3}, 1, 0.4, 40, 20);
    test::writePly(mesh, folder / "torus.ply");
    BuildOptions options;
    options.inputs = {folder / "torus.ply"};
    options.output = folder / "plain.vcp";
    ASSERT_TRUE(buildOctree(options));
    options.output = folder / "sampled.vcp";
    options.sample = std::make_shared<MeshSample>();
    ASSERT_TRUE(buildOctree(options));
    const MeshSample::Snapshot read = options.sample->snapshot();
    EXPECT_EQ(read.trianglesEach, 1u);
    ASSERT_EQ(read.triangles.size(), mesh.triangles.size());
    for (size_t k = 0; k < read.triangles.size(); ++k)
        for (int i = 0; i < 3; ++i) {
            const glm::dvec3 corner = read.origin + glm::dvec3(read.triangles[k].corner[i]);
            EXPECT_LT(glm::distance(corner, mesh.positions[mesh.triangles[k][i]]), 1e-6);
        }
    EXPECT_EQ(read.vertices.size(), mesh.positions.size());
    EXPECT_EQ(contentOf(folder / "plain.vcp"), contentOf(folder / "sampled.vcp"));
}

}  // namespace
}  // namespace vcp
