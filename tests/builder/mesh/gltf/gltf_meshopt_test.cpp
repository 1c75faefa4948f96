// What meshoptimizer's own encoders wrote, in every mode and through every filter, against the same values as they are.
#include <cmath>
#include <random>

#include <meshoptimizer.h>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include "builder/mesh/gltf/gltf.h"
#include "tests/support/gltf_files.h"
#include "tests/support/mesh_reading.h"

namespace vcp {
namespace {

using test::GltfFile;
using test::readAll;
using test::ReadMesh;

Result<std::unique_ptr<MeshStream>> openMeshopt(ByteSource source) { return openGltf(std::move(source), {}, {}); }
ReadMesh readMeshopt(const std::string& bytes) { return test::readEveryWindow(openMeshopt, bytes); }
std::string lineOfMeshopt(const std::string& bytes) {
    const ReadMesh mesh = readMeshopt(bytes);
    EXPECT_TRUE(mesh.error) << bytes;
    return mesh.line();
}

template <class T>
std::string bytesOf(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string ofVertices(const std::string& values, size_t stride) {
    const size_t count = values.size() / stride;
    std::string to(meshopt_encodeVertexBufferBound(count, stride), '\0');
    to.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(to.data()), to.size(), values.data(), count,
                                         stride));
    return to;
}
std::string ofTriangles(const std::vector<uint32_t>& indices, size_t vertices) {
    std::string to(meshopt_encodeIndexBufferBound(indices.size(), vertices), '\0');
    to.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(to.data()), to.size(), indices.data(),
                                        indices.size()));
    return to;
}
std::string ofIndices(const std::vector<uint32_t>& indices, size_t vertices) {
    std::string to(meshopt_encodeIndexSequenceBound(indices.size(), vertices), '\0');
    to.resize(meshopt_encodeIndexSequence(reinterpret_cast<unsigned char*>(to.data()), to.size(), indices.data(),
                                          indices.size()));
    return to;
}

/// A file whose views are compressed: buffer 0 holds what is stored, buffer 1 is a fallback that does not exist.
struct CompressedFile {
    std::string stored;
    uint64_t fallback = 0;
    std::vector<std::string> views, accessors;
    std::string meshes, nodes = R"({"mesh":0})", name = "EXT_meshopt_compression",
                        required = R"("EXT_meshopt_compression")";

    size_t view(const std::string& compressed, size_t count, size_t stride, const std::string& mode,
                const std::string& filter = "") {
        while (stored.size() % 4) stored += '\0';
        const std::string declared = mode == "ATTRIBUTES" ? fmt::format(R"(,"byteStride":{})", stride) : "";
        views.push_back(fmt::format(
            R"({{"buffer":1,"byteOffset":{},"byteLength":{}{},"extensions":{{"{}":{{"buffer":0,"byteOffset":{},"byteLength":{},"byteStride":{},"count":{},"mode":"{}"{}}}}}}})",
            fallback, count * stride, declared, name, stored.size(), compressed.size(), stride, count, mode,
            filter.empty() ? "" : fmt::format(R"(,"filter":"{}")", filter)));
        stored += compressed;
        fallback += count * stride;
        return views.size() - 1;
    }
    void accessor(size_t view, int component, const char* type, size_t count, const std::string& extra = "") {
        accessors.push_back(fmt::format(R"({{"bufferView":{},"componentType":{},"type":"{}","count":{}{}}})", view,
                                        component, type, count, extra));
    }
    [[nodiscard]] std::string json(const std::string& uri) const {
        return fmt::format(
            R"({{"asset":{{"version":"2.0"}},"extensionsUsed":["{}"],"extensionsRequired":[{}],"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{}],"meshes":[{}],"accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}{}}},{{"byteLength":{},"extensions":{{"{}":{{"fallback":true}}}}}}]}})",
            name, required, nodes, meshes, fmt::join(accessors, ","), fmt::join(views, ","), stored.size(), uri,
            fallback, name);
    }
    [[nodiscard]] std::string embedded() const {
        return json(R"(,"uri":"data:application/octet-stream;base64,)" + test::base64(stored) + '"');
    }
    [[nodiscard]] std::string glb() const {
        std::string text = json(""), binary = stored;
        while (text.size() % 4) text += ' ';
        while (binary.size() % 4) binary += '\0';
        const auto word = [](size_t value) { return test::bytesOf({uint32_t(value)}); };
        return "glTF" + word(2) + word(28 + text.size() + binary.size()) + word(text.size()) + "JSON" + text +
               word(binary.size()) + std::string("BIN\0", 4) + binary;
    }
};

/// A wavy sheet of 16 by 16 squares.
struct Sheet {
    static constexpr uint32_t kEdge = 17, kVertices = kEdge * kEdge;
    std::vector<float> positions;
    std::vector<uint32_t> indices;

    Sheet() {
        for (uint32_t y = 0; y < kEdge; ++y)
            for (uint32_t x = 0; x < kEdge; ++x)
                for (const float value : {float(x) / 16, float(y) / 16, std::sin(float(x * y) / 40)})
                    positions.push_back(value);
        for (uint32_t y = 0; y + 1 < kEdge; ++y)
            for (uint32_t x = 0; x + 1 < kEdge; ++x) {
                const uint32_t at = y * kEdge + x;
                for (const uint32_t index : {at, at + 1, at + kEdge, at + kEdge, at + 1, at + kEdge + 1})
                    indices.push_back(index);
            }
    }
    /// 16 bits of each coordinate, from -1 to 1, and two bytes of padding.
    [[nodiscard]] std::vector<uint16_t> quantized() const {
        std::vector<uint16_t> values;
        for (size_t i = 0; i < positions.size(); ++i) {
            values.push_back(uint16_t(std::lround((positions[i] + 1) * 32767.5f)));
            if (i % 3 == 2) values.push_back(0);
        }
        return values;
    }
};

/// Triangles may begin at another corner.
std::vector<std::array<glm::dvec3, 3>> soupOf(const ReadMesh& mesh) {
    std::vector<std::array<glm::dvec3, 3>> soup;
    const auto before = [](const glm::dvec3& a, const glm::dvec3& b) {
        return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
    };
    for (const auto& t : mesh.triangles) {
        std::array<glm::dvec3, 3> corners{mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
        std::rotate(corners.begin(), std::ranges::min_element(corners, before), corners.end());
        soup.push_back(corners);
    }
    return soup;
}

const std::string kPrimitive = R"({"primitives":[{"attributes":{"POSITION":0},"indices":1}]})";

GltfFile plainSheet() {
    const Sheet sheet;
    GltfFile file;
    file.accessor(bytesOf(sheet.positions), 5126, "VEC3", Sheet::kVertices);
    file.accessor(bytesOf(sheet.indices), 5125, "SCALAR", sheet.indices.size());
    file.meshes = kPrimitive;
    return file;
}

CompressedFile compressedSheet() {
    const Sheet sheet;
    CompressedFile file;
    const size_t positions = file.view(ofVertices(bytesOf(sheet.positions), 12), Sheet::kVertices, 12, "ATTRIBUTES");
    file.accessor(positions, 5126, "VEC3", Sheet::kVertices);
    const size_t count = sheet.indices.size();
    const size_t indices = file.view(ofTriangles(sheet.indices, Sheet::kVertices), count, 4, "TRIANGLES");
    file.accessor(indices, 5125, "SCALAR", count);
    file.meshes = kPrimitive;
    return file;
}

TEST(GltfMeshopt, ReadsTheSameTrianglesAsWithoutCompression) {
    const ReadMesh plain = readMeshopt(plainSheet().embedded());
    ASSERT_FALSE(plain.error) << plain.line();
    ASSERT_EQ(plain.triangles.size(), 512u);
    CompressedFile file = compressedSheet();
    EXPECT_LT(file.stored.size(), plainSheet().buffer.size() / 2);
    for (const std::string& bytes : {file.embedded(), file.glb()}) {
        const ReadMesh mesh = readMeshopt(bytes);
        ASSERT_FALSE(mesh.error) << mesh.line();
        EXPECT_EQ(mesh.positions, plain.positions);
        EXPECT_EQ(soupOf(mesh), soupOf(plain));
    }
    // By its later name, and where it is not required.
    for (const auto& [name, required] : {std::pair("KHR_meshopt_compression", R"("KHR_meshopt_compression")"),
                                         std::pair("EXT_meshopt_compression", "")}) {
        CompressedFile other;
        other.name = name;
        other.required = required;
        const CompressedFile same = compressedSheet();
        other.stored = same.stored, other.fallback = same.fallback, other.accessors = same.accessors;
        other.meshes = same.meshes;
        for (std::string view : same.views)
            other.views.push_back(view.replace(view.find("EXT_meshopt"), 11, std::string(name).substr(0, 11)));
        const ReadMesh mesh = readMeshopt(other.embedded());
        ASSERT_FALSE(mesh.error) << mesh.line();
        EXPECT_EQ(soupOf(mesh), soupOf(plain));
    }
}

TEST(GltfMeshopt, IndicesOfTwoBytesAndSequences) {
    const Sheet sheet;
    const ReadMesh plain = readMeshopt(plainSheet().embedded());
    for (const std::string& mode : {std::string("TRIANGLES"), std::string("INDICES")})
        for (const size_t size : {size_t{2}, size_t{4}}) {
            CompressedFile file = compressedSheet();
            file.accessors.pop_back();
            const std::string stored = mode == "INDICES" ? ofIndices(sheet.indices, Sheet::kVertices)
                                                         : ofTriangles(sheet.indices, Sheet::kVertices);
            const size_t view = file.view(stored, sheet.indices.size(), size, mode);
            file.accessor(view, size == 2 ? 5123 : 5125, "SCALAR", sheet.indices.size());
            const ReadMesh mesh = readMeshopt(file.embedded());
            ASSERT_FALSE(mesh.error) << mesh.line();
            EXPECT_EQ(soupOf(mesh), soupOf(plain)) << mode << size;
            if (mode == "INDICES") {
                EXPECT_EQ(mesh.triangles, plain.triangles);
            }
        }
}

// As gltfpack does by default: positions of 16 bits that the node moves back, texture coordinates that the material's
// transform does, colours of bytes.
TEST(GltfMeshopt, QuantizedAttributes) {
    const Sheet sheet;
    for (const bool isNormalized : {false, true}) {
        GltfFile plain;
        CompressedFile file;
        const std::string values = bytesOf(sheet.quantized());
        const std::string extra = isNormalized ? R"(,"normalized":true)" : "";
        std::string uvs, colours;
        for (uint32_t i = 0; i < Sheet::kVertices; ++i) {
            uvs += test::bytesOf<uint16_t>({uint16_t(i * 100), uint16_t(i)});
            colours += test::bytesOf<uint8_t>({uint8_t(i), 128, 255, 255});
        }
        const std::string normalized = R"(,"normalized":true)";
        file.accessor(file.view(ofVertices(values, 8), Sheet::kVertices, 8, "ATTRIBUTES", "NONE"), 5123, "VEC3",
                      Sheet::kVertices, extra);
        const size_t count = sheet.indices.size();
        file.accessor(file.view(ofTriangles(sheet.indices, Sheet::kVertices), count, 2, "TRIANGLES"), 5123, "SCALAR",
                      count);
        file.accessor(file.view(ofVertices(uvs, 4), Sheet::kVertices, 4, "ATTRIBUTES"), 5123, "VEC2", Sheet::kVertices,
                      normalized);
        file.accessor(file.view(ofVertices(colours, 4), Sheet::kVertices, 4, "ATTRIBUTES"), 5121, "VEC4",
                      Sheet::kVertices, normalized);
        plain.view(values, R"(,"byteStride":8)");
        plain.accessors.push_back(fmt::format(R"({{"bufferView":0,"componentType":5123,"type":"VEC3","count":{}{}}})",
                                              Sheet::kVertices, extra));
        plain.accessor(bytesOf(std::vector<uint16_t>(sheet.indices.begin(), sheet.indices.end())), 5123, "SCALAR",
                       count);
        plain.accessor(uvs, 5123, "VEC2", Sheet::kVertices, normalized);
        plain.accessor(colours, 5121, "VEC4", Sheet::kVertices, normalized);
        file.meshes = plain.meshes =
            R"({"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2,"COLOR_0":3},"indices":1}]})";
        const double step = isNormalized ? 2 : 2 / 65535.0;
        file.nodes = plain.nodes = fmt::format(R"({{"mesh":0,"translation":[-1,-1,-1],"scale":[{0},{0},{0}]}})", step);
        file.required = R"("KHR_mesh_quantization","EXT_meshopt_compression","KHR_texture_transform")";
        const ReadMesh expected = readMeshopt(plain.embedded()), mesh = readMeshopt(file.embedded());
        ASSERT_FALSE(mesh.error) << mesh.line();
        EXPECT_EQ(mesh.positions, expected.positions);
        EXPECT_EQ(mesh.colours, expected.colours);
        EXPECT_EQ(soupOf(mesh), soupOf(expected));
        for (size_t i = 0; i < sheet.positions.size(); ++i)
            EXPECT_NEAR(mesh.positions[i / 3][int(i % 3)], sheet.positions[i], 1e-4) << i;
    }
}

// Values that pass through a filter: shown as positions, which every component type may have.
TEST(GltfMeshopt, EveryFilter) {
    constexpr size_t kCount = 30;
    std::mt19937 random(1);
    std::vector<float> units;
    for (size_t i = 0; i < kCount; ++i) {
        glm::dvec4 v(0);
        for (int c = 0; c < 4; ++c) v[c] = double(random() % 2001) / 1000 - 1;
        v /= std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z + v.w * v.w);
        for (int c = 0; c < 4; ++c) units.push_back(float(v[c]));
    }
    struct Filter {
        const char* name;
        size_t stride;
        int component;
        double tolerance;
    };
    for (const Filter& filter : {Filter{"OCTAHEDRAL", 4, 5120, 0.02}, Filter{"OCTAHEDRAL", 8, 5122, 1e-4},
                                 Filter{"QUATERNION", 8, 5122, 1e-4}, Filter{"EXPONENTIAL", 16, 5126, 1e-4}}) {
        std::string values(kCount * filter.stride, '\0');
        const bool isOct = filter.name[0] == 'O';
        std::vector<float> wanted = units;
        if (isOct)
            for (size_t i = 0; i < kCount; ++i) {
                float* const v = wanted.data() + 4 * i;
                const float length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
                for (int c = 0; c < 3; ++c) v[c] /= length;
            }
        if (isOct)
            meshopt_encodeFilterOct(values.data(), kCount, filter.stride, filter.stride == 4 ? 8 : 16, wanted.data());
        if (filter.name[0] == 'Q') meshopt_encodeFilterQuat(values.data(), kCount, filter.stride, 16, wanted.data());
        if (filter.name[0] == 'E') meshopt_encodeFilterExp(values.data(), kCount, filter.stride, 20, wanted.data());
        CompressedFile file;
        const size_t view =
            file.view(ofVertices(values, filter.stride), kCount, filter.stride, "ATTRIBUTES", filter.name);
        file.accessor(view, filter.component, "VEC3", kCount, filter.component == 5126 ? "" : R"(,"normalized":true)");
        file.meshes = R"({"primitives":[{"attributes":{"POSITION":0}}]})";
        const ReadMesh mesh = readMeshopt(file.embedded());
        ASSERT_FALSE(mesh.error) << filter.name << mesh.line();
        ASSERT_EQ(mesh.positions.size(), kCount);
        for (size_t i = 0; i < kCount; ++i) {
            // A quaternion and its opposite are the same turn.
            const glm::dvec3 v(wanted[4 * i], wanted[4 * i + 1], wanted[4 * i + 2]), got = mesh.positions[i];
            const double apart = std::min(glm::length(got - v), filter.name[0] == 'Q' ? glm::length(got + v) : 9.0);
            EXPECT_LT(apart, 3 * filter.tolerance) << filter.name << filter.stride << ' ' << i;
        }
    }
}

TEST(GltfMeshopt, EveryTruncationIsAnError) {
    const Sheet sheet;
    const std::string vertices = ofVertices(bytesOf(sheet.positions), 12);
    for (const std::string& mode : {std::string("ATTRIBUTES"), std::string("TRIANGLES"), std::string("INDICES")}) {
        const std::string whole = mode == "ATTRIBUTES"  ? vertices
                                  : mode == "TRIANGLES" ? ofTriangles(sheet.indices, Sheet::kVertices)
                                                        : ofIndices(sheet.indices, Sheet::kVertices);
        for (size_t kept = 0; kept < whole.size(); ++kept) {
            CompressedFile file;
            const std::string cut = whole.substr(0, kept);
            const size_t position =
                file.view(mode == "ATTRIBUTES" ? cut : vertices, Sheet::kVertices, 12, "ATTRIBUTES");
            file.accessor(position, 5126, "VEC3", Sheet::kVertices);
            const size_t count = sheet.indices.size();
            const size_t index = mode == "ATTRIBUTES"
                                     ? file.view(ofTriangles(sheet.indices, Sheet::kVertices), count, 4, "TRIANGLES")
                                     : file.view(cut, count, 4, mode);
            file.accessor(index, 5125, "SCALAR", count);
            file.meshes = kPrimitive;
            const std::string bytes = file.embedded();
            const ReadMesh mesh = readAll(openMeshopt(ByteSource::fromMemory(bytes, "mesh")));
            ASSERT_TRUE(mesh.error) << mode << ' ' << kept << " of " << whole.size();
            EXPECT_NE(mesh.line().find("meshopt data are damaged"), std::string::npos) << mesh.line();
            EXPECT_NE(mesh.line().find(mode == "ATTRIBUTES" ? "mesh: bufferView 0" : "mesh: bufferView 1"),
                      std::string::npos)
                << mesh.line();
        }
    }
}

TEST(GltfMeshopt, FlippedBitsAreReadOrRefusedInOneLine) {
    const CompressedFile whole = compressedSheet();
    size_t refused = 0, readWrong = 0;
    for (size_t bit = 0; bit < 8 * whole.stored.size(); bit += 3) {
        CompressedFile file = whole;
        file.stored[bit / 8] = char(file.stored[bit / 8] ^ 1 << bit % 8);
        const std::string bytes = file.embedded();
        const ReadMesh mesh = readAll(openMeshopt(ByteSource::fromMemory(bytes, "mesh")));
        EXPECT_EQ(mesh.line().find('\n'), std::string::npos) << bit;
        mesh.error ? ++refused : ++readWrong;
    }
    EXPECT_GT(refused, 10u);
    EXPECT_GT(readWrong, 10u);
}

// What the decoders assert, and what would make them write, or us allocate, more than there is.
TEST(GltfMeshopt, WhatIsWrongIsNamed) {
    const auto with = [](size_t view, const std::string& from, const std::string& to) {
        CompressedFile file = compressedSheet();
        std::string& text = file.views[view];
        const size_t at = text.rfind(from);
        EXPECT_NE(at, std::string::npos) << from;
        text.replace(at, from.size(), to);
        return lineOfMeshopt(file.embedded());
    };
    const auto has = [](const std::string& line, const char* part) {
        return line.find(part) != std::string::npos ? "" : line;
    };
    for (const auto& [from, key] :
         {std::pair(R"("buffer":0,)", "'buffer'"), std::pair(R"("byteStride":12,)", "'byteStride'"),
          std::pair(R"("count":289,)", "'count'")})
        EXPECT_EQ(has(with(0, from, ""), key), "");
    EXPECT_EQ(has(with(1, R"(,"mode":"TRIANGLES")", ""), "bufferView 1: EXT_meshopt_compression: its mode is not"), "");
    EXPECT_EQ(has(with(1, "TRIANGLES", "LINES"), "its mode is not"), "");
    EXPECT_EQ(has(with(0, R"("mode")", R"("filter":"COLOR","mode")"), "its filter is not"), "");
    EXPECT_EQ(has(with(1, R"("mode")", R"("filter":"EXPONENTIAL","mode")"), "indices without a filter"), "");
    EXPECT_EQ(has(with(0, R"("mode")", R"("filter":"OCTAHEDRAL","mode")"), "OCTAHEDRAL"), "");
    EXPECT_EQ(has(with(0, R"("mode")", R"("filter":"QUATERNION","mode")"), "QUATERNION"), "");
    for (const char* stride : {"0", "2", "13", "260", "9007199254740992"})
        EXPECT_EQ(has(with(0, R"("byteStride":12)", fmt::format(R"("byteStride":{})", stride)), "in fours"), "")
            << stride;
    for (const char* stride : {"0", "1", "3", "8"})
        EXPECT_EQ(has(with(1, R"("byteStride":4)", fmt::format(R"("byteStride":{})", stride)), "2 or 4 bytes"), "");
    EXPECT_EQ(has(with(1, R"("count":1536)", R"("count":1537)"), "whole triangles"), "");
    for (const char* count : {"288", "290", "0", "9007199254740992"})
        EXPECT_EQ(has(with(0, R"("count":289)", fmt::format(R"("count":{})", count)), "are not the 3468 bytes"), "");
    EXPECT_EQ(has(with(0, R"("byteOffset":0)", R"("byteOffset":9007199254740992)"), "lie outside buffer 0"), "");
    EXPECT_EQ(has(with(0, R"("buffer":0)", R"("buffer":7)"), "'buffer' is 7"), "");
    EXPECT_EQ(has(with(0, R"("mode":"ATTRIBUTES")", R"("mode":"INDICES")"), "2 or 4 bytes"), "");
    EXPECT_EQ(has(with(1, "TRIANGLES", "INDICES"), "of another kind"), "");
    // A stride of its own, other than that of the view.
    EXPECT_EQ(has(with(0, R"("byteStride":12,"count":289)", R"("byteStride":4,"count":867)"), "with its byteStride"),
              "");

    CompressedFile later = compressedSheet();
    later.stored[0] = '\xAF';
    EXPECT_EQ(has(lineOfMeshopt(later.embedded()), "version 15 of its meshopt data is not read"), "");
    CompressedFile empty = compressedSheet();
    empty.views[0] = R"({"buffer":1,"byteLength":3468,"byteStride":12})";
    EXPECT_EQ(has(lineOfMeshopt(empty.embedded()), "buffer 1: has neither"), "");
}

TEST(GltfMeshopt, CountsAreCheckedAgainstTheBytesBeforeAnythingIsAllocated) {
    const auto claim = [](size_t count, size_t stride, const std::string& mode, const std::string& bytes, size_t more) {
        CompressedFile file;
        file.accessor(file.view(bytes, count, stride, mode), 5126, "VEC3", mode == "ATTRIBUTES" ? count : 4);
        file.meshes = R"({"primitives":[{"attributes":{"POSITION":0}}]})";
        file.stored.resize(file.stored.size() + more);
        return file;
    };
    // 256 times its bytes, together and each.
    const auto line = lineOfMeshopt(claim(size_t{1} << 36, 16, "ATTRIBUTES", std::string(99, '\xA0'), 0).embedded());
    EXPECT_NE(line.find("more than 64 times their buffers"), std::string::npos) << line;
    const std::string each = claim(65536, 16, "ATTRIBUTES", std::string(4096, '\xA0'), 65536).embedded();
    EXPECT_NE(lineOfMeshopt(each).find("4096 bytes cannot hold 65536 values"), std::string::npos)
        << lineOfMeshopt(each);
    const std::string triangles = claim(3 * 65536, 4, "TRIANGLES", std::string(65536, '\xE0'), 65536).embedded();
    EXPECT_NE(lineOfMeshopt(triangles).find("cannot hold"), std::string::npos) << lineOfMeshopt(triangles);
    const std::string indices = claim(65536, 4, "INDICES", std::string(65536, '\xD0'), 65536).embedded();
    EXPECT_NE(lineOfMeshopt(indices).find("cannot hold"), std::string::npos) << lineOfMeshopt(indices);

    // One byte may stand for many equal values: these are read, but not with less memory than they need.
    const std::string flat = claim(65536, 16, "ATTRIBUTES", ofVertices(std::string(1 << 20, '\1'), 16), 0).embedded();
    EXPECT_FALSE(readMeshopt(flat).error) << readMeshopt(flat).line();
    MeshOpenOptions options;
    options.decoderBytes = 1 << 20;
    const ReadMesh small = readAll(openGltf(ByteSource::fromMemory(flat, "mesh"), {}, options));
    ASSERT_TRUE(small.error);
    EXPECT_EQ(small.error->code, ErrorCode::Limit) << small.line();
}

}  // namespace
}  // namespace vcp
