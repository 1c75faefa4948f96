// The scan generator: exact counts, the same bytes for a seed, closed parts closed, memory bounded.
#include "datasets_scripts/scan_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include <gtest/gtest.h>
#include <png.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "datasets_scripts/dog.h"
#include "datasets_scripts/procedural_noise.h"
#include "datasets_scripts/test_picture.h"

namespace vcp::scan {
namespace {

std::vector<std::byte> bytesOf(const ScanMesh& mesh) {
    std::vector<std::byte> bytes;
    const auto result = mesh.writePly([&](std::span<const std::byte> piece) -> Result<void> {
        EXPECT_LE(piece.size(), ScanMesh::kBufferBytes);
        bytes.insert(bytes.end(), piece.begin(), piece.end());
        return {};
    });
    EXPECT_TRUE(result.ok());
    return bytes;
}

struct Mesh {
    std::vector<glm::dvec3> positions;
    std::vector<std::array<uint32_t, 3>> triangles;
};

/// Reads back what was written, without colour or UTM.
Mesh parse(const ScanMesh& mesh, const std::vector<std::byte>& bytes) {
    Mesh parsed;
    const std::byte* at = bytes.data() + mesh.header().size();
    for (uint64_t i = 0; i < mesh.vertices(); ++i, at += 12) {
        std::array<float, 3> p;
        std::memcpy(p.data(), at, 12);
        parsed.positions.emplace_back(p[0], p[1], p[2]);
    }
    for (uint64_t i = 0; i < mesh.triangles(); ++i, at += 13) {
        EXPECT_EQ(at[0], std::byte{3});
        std::array<uint32_t, 3> corners;
        std::memcpy(corners.data(), at + 1, 12);
        parsed.triangles.push_back(corners);
    }
    EXPECT_EQ(at, bytes.data() + bytes.size());
    return parsed;
}

TEST(ScanMesh, AnObjIsTheSameMeshWithPlacesInItsCharts) {
    const ScanMesh mesh({.triangles = 20'000, .seed = 3});
    const Mesh ply = parse(mesh, bytesOf(mesh));
    std::string text;
    const auto written = mesh.writeObj(
        [&](std::span<const std::byte> piece) -> Result<void> {
            text.append(reinterpret_cast<const char*>(piece.data()), piece.size());
            return {};
        },
        "its.mtl");
    ASSERT_TRUE(written.ok());
    EXPECT_NE(text.find("mtllib its.mtl\nusemtl scan\n"), std::string::npos);
    std::vector<glm::dvec2> places;
    size_t vertices = 0, triangles = 0;
    double widest = 0;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        glm::dvec3 p;
        glm::dvec2 uv;
        std::array<unsigned, 3> v, t;
        if (std::sscanf(line.c_str(), "v %lf %lf %lf", &p.x, &p.y, &p.z) == 3) {
            ASSERT_LT(glm::distance(p, ply.positions[vertices++]), 2e-6);
        } else if (std::sscanf(line.c_str(), "vt %lf %lf", &uv.x, &uv.y) == 2) {
            places.push_back(uv);
        } else if (std::sscanf(line.c_str(), "f %u/%u %u/%u %u/%u", &v[0], &t[0], &v[1], &t[1], &v[2], &t[2]) == 6) {
            for (size_t i = 0; i < 3; ++i) {
                ASSERT_EQ(v[i] - 1, ply.triangles[triangles][i]);
                ASSERT_LE(t[i], places.size());
                const glm::dvec2 side = glm::abs(places[t[i] - 1] - places[t[(i + 1) % 3] - 1]);
                widest = std::max(widest, side.x);
            }
            ++triangles;
        }
    }
    EXPECT_EQ(vertices, ply.positions.size());
    EXPECT_EQ(triangles, 20'000u);
    // A triangle across a part's seam would be as wide as its chart, and those are a tenth of the picture.
    EXPECT_LT(widest, 0.05);
}

TEST(TestPicture, HasItsTexels) {
    std::string file;
    const auto written = writeTestPicture(300, PictureKind::Png, [&](std::span<const std::byte> bytes) -> Result<void> {
        file.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        return {};
    });
    ASSERT_TRUE(written.ok());
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    ASSERT_TRUE(png_image_begin_read_from_memory(&png, file.data(), file.size()));
    ASSERT_EQ(png.width, 300u);
    ASSERT_EQ(png.height, 300u);
    png.format = PNG_FORMAT_RGB;
    std::vector<uint8_t> bytes(size_t{3} * 300 * 300);
    ASSERT_TRUE(png_image_finish_read(&png, nullptr, bytes.data(), 0, nullptr));
    for (uint32_t i = 0; i < 300 * 300; ++i)
        for (uint32_t c = 0; c < 3; ++c) ASSERT_EQ(bytes[3 * i + c], testTexel(i % 300, i / 300)[c]) << i;
    // The digit of the second cell's column is a 1, and not a 7.
    const auto isRed = [](uint32_t x, uint32_t y) { return testTexel(x, y) == std::array<uint8_t, 3>{200, 30, 20}; };
    const uint32_t left = 128 + 16 + 2 * 32;
    EXPECT_FALSE(isRed(left + 4, 12));
    EXPECT_TRUE(isRed(left + 12, 12));
    EXPECT_FALSE(isRed(left + 20, 12));
    for (const PictureKind kind : {PictureKind::Png, PictureKind::Jpeg}) {
        const auto full = writeTestPicture(300, kind, [&](std::span<const std::byte>) -> Result<void> {
            return Error{.code = ErrorCode::Io, .message = "full"};
        });
        EXPECT_FALSE(full.ok());
    }
}

TEST(ScanMesh, CountsAreExact) {
    for (const uint64_t triangles : {10'000u, 10'001u, 12'345u, 99'999u, 250'000u})
        for (const bool colour : {false, true}) {
            const ScanMesh mesh({.triangles = triangles, .seed = 7, .colour = colour, .utm = colour});
            EXPECT_EQ(mesh.triangles(), triangles);
            EXPECT_EQ(bytesOf(mesh).size(), mesh.fileBytes()) << triangles;
        }
}

TEST(ScanMesh, PlansUpToABillion) {
    for (const uint64_t triangles : {kMinTriangles, uint64_t(1'000'003), uint64_t(99'999'999), kMaxTriangles}) {
        const ScanMesh mesh({.triangles = triangles});
        uint64_t vertices = 0, sum = 0;
        for (const GridPart& part : mesh.parts()) {
            EXPECT_EQ(part.firstVertex, vertices);
            EXPECT_EQ(part.firstTriangle, sum);
            EXPECT_GT(part.triangles, 0u) << part.part.name;
            vertices += part.vertices;
            sum += part.triangles;
        }
        EXPECT_EQ(sum, triangles);
        EXPECT_EQ(vertices, mesh.vertices());
        EXPECT_LT(vertices, std::numeric_limits<uint32_t>::max());
        // The strip takes the rest, which must stay a rest.
        EXPECT_LT(mesh.parts().back().triangles, triangles / 20);
    }
}

TEST(ScanMesh, SeedDecidesEveryByte) {
    const ScanOptions options{.triangles = 20'000, .seed = 3, .colour = true};
    ScanOptions other = options;
    other.seed = 4;
    const auto first = bytesOf(ScanMesh(options));
    EXPECT_EQ(first, bytesOf(ScanMesh(options)));
    EXPECT_NE(first, bytesOf(ScanMesh(other)));
}

TEST(ScanMesh, BytesAreTheSameOnEverySystem) {
    uint64_t sum = 0;
    for (const std::byte byte : bytesOf(ScanMesh({.triangles = 10'000, .seed = 1, .colour = true})))
        sum = hash(sum ^ uint64_t(byte));
    EXPECT_EQ(sum, 0xc0412ae4ae40fc7cu) << std::hex << "0x" << sum;
}

TEST(ScanMesh, ClosedPartsAreClosedAndFaceOutward) {
    const ScanMesh mesh({.triangles = 10'000});
    const Mesh parsed = parse(mesh, bytesOf(mesh));
    for (const GridPart& part : mesh.parts()) {
        std::map<std::pair<uint32_t, uint32_t>, int> edges;
        double volume = 0;
        for (uint64_t i = part.firstTriangle; i < part.firstTriangle + part.triangles; ++i) {
            const auto& t = parsed.triangles[i];
            for (int k = 0; k < 3; ++k) {
                ASSERT_GE(t[k], part.firstVertex);
                ASSERT_LT(t[k], part.firstVertex + part.vertices);
                ++edges[{t[k], t[(k + 1) % 3]}];
            }
            volume += glm::dot(parsed.positions[t[0]], glm::cross(parsed.positions[t[1]], parsed.positions[t[2]])) / 6;
        }
        size_t unmatched = 0;
        for (const auto& [edge, count] : edges) {
            EXPECT_EQ(count, 1) << part.part.name << ": an edge is used twice in one direction";
            unmatched += !edges.contains({edge.second, edge.first});
        }
        if (part.part.closed()) {
            EXPECT_EQ(unmatched, 0u) << part.part.name;
            EXPECT_GT(volume, 0) << part.part.name;
        } else {
            EXPECT_GT(unmatched, 0u) << part.part.name;
        }
    }
}

TEST(ScanMesh, ShawlHasHolesAtAnySize) {
    for (const uint64_t triangles : {kMinTriangles, uint64_t(1'000'000)}) {
        const ScanMesh mesh({.triangles = triangles});
        const auto& parts = mesh.parts();
        const auto shawl = std::ranges::find_if(parts, [](const GridPart& part) { return part.part.name == "shawl"; });
        ASSERT_NE(shawl, parts.end());
        EXPECT_LT(shawl->triangles, 2 * (shawl->columns - 1) * (shawl->rows - 1));
    }
}

TEST(ScanMesh, HasSliversAndNoPointTriangles) {
    const ScanMesh mesh({.triangles = 50'000});
    const Mesh parsed = parse(mesh, bytesOf(mesh));
    size_t slivers = 0, points = 0;
    for (const auto& t : parsed.triangles) {
        const glm::dvec3 a = parsed.positions[t[0]], b = parsed.positions[t[1]], c = parsed.positions[t[2]];
        const double longest = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
        const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
        slivers += longest * longest > 20 * 2 * area;
        points += longest < 1e-6;
    }
    EXPECT_GT(slivers, 50u);
    EXPECT_EQ(points, 0u);
}

TEST(ScanMesh, UtmKeepsTheShapeInDoubles) {
    const ScanMesh plain({.triangles = 10'000}), utm({.triangles = 10'000, .utm = true});
    const auto floats = bytesOf(plain), doubles = bytesOf(utm);
    const std::byte* a = floats.data() + plain.header().size();
    const std::byte* b = doubles.data() + utm.header().size();
    double firstShift[3] = {};
    for (uint64_t i = 0; i < plain.vertices(); ++i, a += 12, b += 24) {
        float p[3];
        double q[3];
        std::memcpy(p, a, 12);
        std::memcpy(q, b, 24);
        const double shift[3] = {q[0] - p[0], q[1] + p[2], q[2] - p[1]};
        for (int k = 0; k < 3; ++k) {
            if (i == 0) firstShift[k] = shift[k];
            ASSERT_NEAR(shift[k], firstShift[k], 1e-6) << "vertex " << i;
        }
        ASSERT_GT(q[1], 1e6);
    }
}

TEST(ScanMesh, StopsAtTheFirstWriteError) {
    const ScanMesh mesh({.triangles = 500'000});
    int calls = 0;
    const auto result = mesh.writePly([&](std::span<const std::byte>) -> Result<void> {
        if (++calls < 3) return {};
        return Error{.code = ErrorCode::Io, .message = "full"};
    });
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().message, "full");
    EXPECT_EQ(calls, 3);
}

TEST(ProceduralNoise, SineAgreesWithTheLibrary) {
    for (int i = -4000; i <= 4000; ++i) {
        const double turns = i / 977.0;
        EXPECT_NEAR(sinTurns(turns), std::sin(turns * 2 * M_PI), 1e-9) << turns;
        EXPECT_NEAR(cosTurns(turns), std::cos(turns * 2 * M_PI), 1e-9) << turns;
    }
}

TEST(ProceduralNoise, IsContinuousAcrossCells) {
    const Noise noise(5);
    for (int i = 0; i < 1000; ++i) {
        const uint64_t h = hash(uint64_t(i));
        const glm::dvec3 p(std::floor(10 * signedUnit(h)), 10 * signedUnit(h, 21), 10 * signedUnit(h, 42));
        EXPECT_NEAR(noise(p - glm::dvec3(1e-9, 0, 0)), noise(p + glm::dvec3(1e-9, 0, 0)), 1e-7) << "seed " << i;
    }
}

TEST(Dog, IsClosedAndMapped) {
    for (const uint64_t wanted : {10'000, 40'000}) {
        const DogMesh mesh = dog(wanted);
        EXPECT_NEAR(double(mesh.triangles.size()), double(wanted), 0.1 * double(wanted));
        ASSERT_EQ(mesh.uvs.size(), mesh.triangles.size());
        std::map<std::pair<uint32_t, uint32_t>, int> edges;
        double volume = 0, area = 0, mapped = 0;
        size_t stretched = 0;
        for (size_t i = 0; i < mesh.triangles.size(); ++i) {
            const auto& t = mesh.triangles[i];
            const auto& uv = mesh.uvs[i];
            const glm::dvec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
            volume += glm::dot(a, glm::cross(b, c)) / 6;
            const double here = glm::length(glm::cross(b - a, c - a)) / 2;
            const glm::dvec2 x = uv[1] - uv[0], y = uv[2] - uv[0];
            // A unit is a tenth of a metre.
            const double there = std::abs(x.x * y.y - x.y * y.x) / 2 / 100;
            area += here, mapped += there;
            stretched += there > 4 * here || there < here / 4;
            for (size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
        }
        size_t shared = 0;
        for (const auto& [edge, count] : edges) {
            const auto back = edges.find({edge.second, edge.first});
            ASSERT_TRUE(back != edges.end() && back->second == count) << "a border";
            shared += count > 1;
        }
        EXPECT_LT(shared, 20u) << "where two sides pass through one cell";
        EXPECT_NEAR(volume, 0.17, 0.05) << "counter-clockwise from outside";
        EXPECT_NEAR(mapped / area, 1, 0.25);
        EXPECT_LT(stretched, mesh.triangles.size() / 50);
    }
}

}  // namespace
}  // namespace vcp::scan
