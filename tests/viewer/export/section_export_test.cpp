// Sections as polylines, and their drawings.
#include <numbers>

#include "tests/viewer/export/exported_mesh.h"
#include "viewer/export/section_export.h"

namespace vcp::test {
namespace {

using Lines = std::vector<Polyline>;

Lines linesOf(const IndexedMesh& mesh, const CutPlane& plane) {
    SectionLines section(plane);
    std::vector<Facet> facets;
    for (uint64_t k = 0; k < mesh.triangles.size(); ++k) facets.push_back(mesh.corners(k));
    section.add(facets);
    section.add(facets);  // what comes again counts once
    return section.join();
}

TEST(SectionLines, SphereIsOneCircle) {
    const Lines lines = linesOf(sphereMesh({0, 0, 0}, 1, 60), {{0, 0.6, 0.8}, 0.3});
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_TRUE(lines[0].isClosed);
    const double radius = std::sqrt(1 - 0.09);
    EXPECT_NEAR(lengthOf(lines[0]), 2 * std::numbers::pi * radius, 0.01);
    for (const glm::dvec3& p : lines[0].points) EXPECT_NEAR(glm::dot(p, glm::dvec3(0, 0.6, 0.8)), 0.3, 1e-12);
}

TEST(SectionLines, PlanesThroughVerticesAndEdgesCutOnce) {
    // The cube's grid lies on the plane.
    for (const double offset : {0.5, 0.25, 0.1, 0.0, 1.0}) {
        SCOPED_TRACE(offset);
        const Lines lines = linesOf(boxMesh({0, 0, 0}, {1, 1, 1}, 4), {{0, 0, 1}, offset});
        if (offset == 0) {
            EXPECT_TRUE(lines.empty()) << "all of the cube is above";
        } else {
            ASSERT_EQ(lines.size(), 1u);
            EXPECT_TRUE(lines[0].isClosed);
            EXPECT_NEAR(lengthOf(lines[0]), 4, 1e-12);
        }
    }
}

TEST(SectionLines, BordersEndLines) {
    IndexedMesh sheet = boxMesh({0, 0, 0}, {1, 1, 1}, 8);
    std::erase_if(sheet.triangles, [&](const auto& t) {
        for (const uint32_t v : t)
            if (sheet.positions[v].x != 0) return true;
        return false;
    });
    const Lines lines = linesOf(sheet, {{0, 1, 0}, 0.43});
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_FALSE(lines[0].isClosed);
    EXPECT_NEAR(lengthOf(lines[0]), 1, 1e-12);
}

TEST(SectionLines, AxesAreTheWorldsWhereTheyCan) {
    const PlaneAxes z = axesOf({{0, 0, -1}, -3});
    EXPECT_EQ(z.of({7, 8, 3}), glm::dvec2(7, 8));
    EXPECT_EQ(axesOf({{1, 0, 0}, 3}).of({3, 8, 9}), glm::dvec2(8, 9));
    EXPECT_EQ(axesOf({{0, 1, 0}, 3}).of({7, 3, 9}), glm::dvec2(7, 9));
    const CutPlane tilted{{2, 2, 1}, 6};
    const PlaneAxes axes = axesOf(tilted);
    EXPECT_NEAR(glm::dot(axes.origin, tilted.normal), tilted.offset, 1e-12);
    EXPECT_NEAR(glm::length(axes.of(axes.origin + 2.0 * axes.x + 3.0 * axes.y) - glm::dvec2(2, 3)), 0, 1e-12);
    EXPECT_GT(axes.y.z, 0);
}

const ExportedMesh& builtTorus() {
    static const ExportedMesh built("section", torusMesh({0, 0, 0}, 1, 0.4, 160, 60), {.cell = 0.02});
    return built;
}

SectionFigures write(const ExportedMesh& built, const std::string& file, const CutPlane& plane,
                     uint32_t level = UINT32_MAX, const std::string& unit = "") {
    const SurfaceCut cut = built.cut(level, {}, plane);
    const auto figures = exportSection(built.reader(), cut,
                                       {.output = built / file,
                                        .kind = *outputKindOf(file),
                                        .notes = {{"source", "a--b"}},
                                        .plane = plane,
                                        .unit = unitNamed(unit)});
    EXPECT_TRUE(figures.ok()) << figures.error().line();
    return figures.ok() ? *figures : SectionFigures{};
}

TEST(SectionExport, FinestLevelIsTheSectionOfTheMesh) {
    const ExportedMesh& built = builtTorus();
    for (const CutPlane plane : {CutPlane{{0, 0, 1}, 0.1}, CutPlane{{1, 0, 0}, 0.05}, CutPlane{{1, 2, 3}, 0.2}}) {
        const SectionFigures figures = write(built, "cut.dxf", plane);
        const Lines truth = linesOf(built.mesh(), plane);
        EXPECT_EQ(figures.lines, truth.size());
        EXPECT_EQ(figures.closedLines, truth.size());
        double length = 0;
        for (const Polyline& line : truth) length += lengthOf(line);
        EXPECT_NEAR(figures.length, length, 1e-3 * length);
        EXPECT_LT(figures.certified, 0.002 * 0.02);
        // Only pages that touch the plane are read.
        EXPECT_LT(built.cut(UINT32_MAX, {}, plane).pages().size(), built.cut().pages().size());
    }
}

TEST(SectionExport, CoarserLevelsLieBesideTheMesh) {
    const ExportedMesh& built = builtTorus();
    const CutPlane plane{{0, 1, 0}, 0.013};
    const SurfaceCut cut = built.cut(built.levels() - 2, {}, plane);
    SectionLines section(plane);
    ASSERT_TRUE(streamFacets(built.reader(), cut, {}, false, [&](std::span<const Facet> facets) {
        section.add(facets);
        return Result<void>();
    }));
    const MeshBvh truth(built.mesh());
    const Lines lines = section.join();
    ASSERT_FALSE(lines.empty());
    for (const Polyline& line : lines)
        for (const glm::dvec3& p : line.points) EXPECT_LE(truth.nearestPoint(p)->distance, cut.certifiedError());
}

size_t countOf(const std::string& text, const std::string& word) {
    size_t count = 0;
    for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
    return count;
}

TEST(SectionExport, SvgHasItsTrueSize) {
    const ExportedMesh& built = builtTorus();
    const CutPlane plane{{0, 0, 1}, 0};
    const SectionFigures figures = write(built, "cut.svg", plane, UINT32_MAX, "cm");
    const std::string text = contentOf(built / "cut.svg");
    EXPECT_EQ(countOf(text, "<path"), figures.lines);
    EXPECT_EQ(countOf(text, " Z\""), figures.closedLines);
    // 2.8 wide, and a border of 2 % on either side.
    EXPECT_NE(text.find("width=\"29.1"), std::string::npos) << text.substr(0, 900);
    EXPECT_NE(text.find("<!-- certified_distance "), std::string::npos);
    EXPECT_EQ(text.find("a--b"), std::string::npos) << "a comment of XML has no --";
    write(built, "plain.svg", plane);
    EXPECT_EQ(contentOf(built / "plain.svg").find("mm\""), std::string::npos);
}

TEST(SectionExport, DxfHasItsUnitAndItsPoints) {
    const ExportedMesh& built = builtTorus();
    const SectionFigures figures = write(built, "cut.dxf", {{0, 0, 1}, 0}, UINT32_MAX, "mm");
    write(built, "cut.dxf", {{0, 0, 1}, 0}, UINT32_MAX, "mm");  // a DXF replaces a DXF
    const std::string text = contentOf(built / "cut.dxf");
    EXPECT_EQ(countOf(text, "\nPOLYLINE\n"), figures.lines);
    EXPECT_EQ(countOf(text, "\nVERTEX\n"), figures.points);
    EXPECT_NE(text.find("$INSUNITS\n 70\n4\n"), std::string::npos);
    EXPECT_NE(text.find("999\ncertified_distance "), std::string::npos);
    EXPECT_TRUE(text.ends_with("  0\nEOF\n"));
}

TEST(SectionExport, APlaneBesideTheSurfaceIsAnError) {
    const ExportedMesh& built = builtTorus();
    const CutPlane plane{{0, 0, 1}, 7};
    const SurfaceCut cut = built.cut(UINT32_MAX, {}, plane);
    const auto figures =
        exportSection(built.reader(), cut, {.output = built / "none.svg", .kind = OutputKind::Svg, .plane = plane});
    ASSERT_FALSE(figures.ok());
    EXPECT_FALSE(std::filesystem::exists(built / "none.svg"));
}

}  // namespace
}  // namespace vcp::test
