// The mesh that is being built, as the window draws it: where its triangles are seen, and in which order.
#include "viewer/window/mesh_preview.h"

#include <gtest/gtest.h>
#include <imgui.h>
#include <glm/geometric.hpp>

namespace vcp {
namespace {

constexpr glm::ivec2 kSize(200, 100);
constexpr uint32_t kRed = 0xff0000ffu, kBlue = 0xffff0000u;

WorldTriangle<double> triangle(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c, uint32_t colour) {
    return {.corner = {a, b, c}, .colour = {colour, colour, colour}, .uv = {}, .material = 0};
}

class MeshPreviewTest : public testing::Test {
protected:
    void SetUp() override {
        ImGui::CreateContext();
        ImGui::GetIO().IniFilename = nullptr;  // it would be written where the test runs
        ImGui::GetIO().DisplaySize = {float(kSize.x), float(kSize.y)};
        unsigned char* texels = nullptr;
        int width = 0, height = 0;
        ImGui::GetIO().Fonts->GetTexDataAsRGBA32(&texels, &width, &height);
        ImGui::NewFrame();
        request_.width = uint32_t(kSize.x);
        request_.height = uint32_t(kSize.y);
        request_.camera.eye = glm::dvec3(0, 0, 10);
        request_.camera.verticalFov = 2 * std::atan(0.5);  // at distance 10 the picture is 10 high: ten pixels a unit
    }
    void TearDown() override {
        ImGui::EndFrame();
        ImGui::DestroyContext();
    }

    void add(const WorldTriangle<double>& t) {
        sample_.addVertices(t.corner);
        sample_.addTriangle(t);
    }
    /// Draws what was added. Returns what is drawn over dots, as they follow each other: four corners a patch.
    std::vector<ImDrawVert> drawn() {
        preview_.update(sample_, now_ += 1);
        ImDrawList& list = *ImGui::GetBackgroundDrawList();
        const int before = list.VtxBuffer.Size;
        preview_.draw(list, request_, 2);
        const auto dots = int(4 * sample_.snapshot().vertices.size());
        return {list.VtxBuffer.begin() + before + dots, list.VtxBuffer.end()};
    }
    static void expectAt(const ImDrawVert& vertex, float x, float y) {
        EXPECT_NEAR(vertex.pos.x, x, 1e-3);
        EXPECT_NEAR(vertex.pos.y, y, 1e-3);
    }

    MeshSample sample_{64};
    MeshPreview preview_;
    FrameRequest request_;
    double now_ = 0;
};

TEST_F(MeshPreviewTest, TrianglesAreWhereTheCameraSeesThemFarOnesFirst) {
    EXPECT_FALSE(preview_.isShown());
    add(triangle({0, 0, 0}, {1, 0, 0}, {0, 2, 0}, kRed));
    add(triangle({-1, 0, -10}, {1, 0, -10}, {0, 2, -10}, kBlue));
    const auto vertices = drawn();
    EXPECT_TRUE(preview_.isShown());
    ASSERT_EQ(vertices.size(), 8u);
    EXPECT_EQ(vertices[0].col & 0xffu, 0u) << "the blue one is farther";
    expectAt(vertices[0], 95, 50);
    expectAt(vertices[1], 105, 50);
    expectAt(vertices[2], 100, 40);
    expectAt(vertices[4], 100, 50);
    expectAt(vertices[5], 110, 50);
    expectAt(vertices[6], 100, 30);
    expectAt(vertices[7], 100, 30);
    EXPECT_EQ(vertices[4].col & 0xffffff00u, 0xff000000u) << "a red one shows nothing but red";
    EXPECT_GT(vertices[4].col & 0xffu, 200u);
}

TEST_F(MeshPreviewTest, ParallelRaysKeepSizes) {
    request_.camera.projection = Projection::Orthographic;
    request_.camera.orthographicHeight = 10;
    add(triangle({0, 0, -1000}, {1, 0, -1000}, {0, 2, -1000}, kRed));
    const auto vertices = drawn();
    ASSERT_EQ(vertices.size(), 4u);
    expectAt(vertices[1], 110, 50);
    expectAt(vertices[2], 100, 30);
}

TEST_F(MeshPreviewTest, OneForManyIsASquareAsLargeAsTwiceAll) {
    for (int i = 0; i < 64; ++i) add(triangle({0, 0, 0}, {1, 0, 0}, {0, 2, 0}, kRed));
    const auto vertices = drawn();
    ASSERT_EQ(vertices.size(), 4u * 32);
    const auto side = [&](int i, int k) {
        return glm::distance(glm::vec2(vertices[i].pos.x, vertices[i].pos.y),
                             glm::vec2(vertices[k].pos.x, vertices[k].pos.y));
    };
    // Each stands for two triangles of area 1, of a hundred square pixels each.
    EXPECT_NEAR(side(0, 1) * side(1, 2), 2 * 2 * 100, 0.1);
    EXPECT_NEAR(side(0, 1), side(1, 2), 1e-3);
}

TEST_F(MeshPreviewTest, WhatIsBehindTheEyeOrHasNoAreaIsLeftOut) {
    add(triangle({0, 0, 20}, {1, 0, 20}, {0, 2, 20}, kRed));
    add(triangle({0, 0, 0}, {1, 0, 0}, {0, 2, 11}, kRed));
    add(triangle({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, kRed));
    preview_.update(sample_, now_ += 1);
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const int before = list.VtxBuffer.Size;
    preview_.draw(list, request_, 2);
    EXPECT_EQ(list.VtxBuffer.Size - before, 4 * 5) << "only dots: of nine vertices, four are behind the eye";
}

TEST_F(MeshPreviewTest, ManyPatchesAreDrawnThoughIndicesAreShort) {
    MeshSample large(size_t{1} << 16);
    for (int i = 0; i < 40000; ++i) {
        const auto t = triangle({0, 0, 0}, {1, 0, 0}, {0, 2, 0}, kRed);
        large.addVertices(t.corner);
        large.addTriangle(t);
    }
    preview_.update(large, now_ += 1);
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.Flags |= ImDrawListFlags_AllowVtxOffset;
    const int before = list.VtxBuffer.Size, first = list.IdxBuffer.Size;
    preview_.draw(list, request_, 2);
    const auto patches = int(large.snapshot().vertices.size()) + 40000;
    EXPECT_EQ(list.VtxBuffer.Size - before, 4 * patches);
    EXPECT_EQ(list.IdxBuffer.Size - first, 6 * patches);
    EXPECT_GT(list.CmdBuffer.Size, 1);
}

TEST_F(MeshPreviewTest, ItLooksAFewTimesASecond) {
    add(triangle({0, 0, 0}, {1, 0, 0}, {0, 2, 0}, kRed));
    EXPECT_TRUE(preview_.update(sample_, 10));
    EXPECT_FALSE(preview_.update(sample_, 20)) << "there is nothing new";
    add(triangle({0, 0, 0}, {1, 0, 0}, {0, 2, 0}, kRed));
    EXPECT_FALSE(preview_.update(sample_, 10.1));
    EXPECT_TRUE(preview_.update(sample_, 10.3));
}

}  // namespace
}  // namespace vcp
