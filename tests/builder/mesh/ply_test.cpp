#include "builder/mesh/ply.h"

#include <bit>
#include <cstring>
#include <limits>
#include <random>

#include "builder/mesh/ply_header.h"
#include "tests/support/mesh_reading.h"

namespace vcp {
namespace {

using test::ReadMesh;
using test::Triangle;

constexpr PlyEncoding kEncodings[] = {PlyEncoding::Ascii, PlyEncoding::LittleEndian, PlyEncoding::BigEndian};
constexpr const char* kTypeNames[] = {"char", "uint8", "int16", "ushort", "int", "uint32", "float", "float64"};
constexpr PlyType kTypes[] = {PlyType::Int8,  PlyType::Uint8,  PlyType::Int16,   PlyType::Uint16,
                              PlyType::Int32, PlyType::Uint32, PlyType::Float32, PlyType::Float64};

const char* nameOf(PlyType type) { return kTypeNames[size_t(type)]; }

// Writes a PLY body value by value, the slow and obvious way.
class PlyWriter {
public:
    explicit PlyWriter(PlyEncoding encoding) : encoding_(encoding) {
        constexpr const char* kNames[] = {"ascii", "binary_little_endian", "binary_big_endian"};
        text = std::string("ply\nformat ") + kNames[size_t(encoding)] + " 1.0\n";
    }
    PlyWriter& header(const std::string& line) {
        text += line + "\n";
        return *this;
    }
    PlyWriter& row() {
        if (encoding_ == PlyEncoding::Ascii && text.back() != '\n') text += '\n';
        return *this;
    }
    PlyWriter& value(PlyType type, double value) {
        using enum PlyType;
        switch (type) {
            case Int8:
                return put<int8_t>(value);
            case Uint8:
                return put<uint8_t>(value);
            case Int16:
                return put<int16_t>(value);
            case Uint16:
                return put<uint16_t>(value);
            case Int32:
                return put<int32_t>(value);
            case Uint32:
                return put<uint32_t>(value);
            case Float32:
                return put<float>(value);
            case Float64:
                return put<double>(value);
        }
        return *this;
    }
    PlyWriter& values(PlyType type, std::initializer_list<double> all) {
        for (const double v : all) value(type, v);
        return *this;
    }
    PlyWriter& list(PlyType count, PlyType type, std::initializer_list<double> all) {
        value(count, double(all.size()));
        return values(type, all);
    }

    std::string text;

private:
    template <class T>
    PlyWriter& put(double value) {
        if (encoding_ == PlyEncoding::Ascii) {
            char word[40];
            std::snprintf(word, sizeof word, "%.17g ", value);
            text += word;
            return *this;
        }
        const T typed = static_cast<T>(value);
        char bytes[sizeof(T)];
        std::memcpy(bytes, &typed, sizeof(T));
        if (encoding_ == PlyEncoding::BigEndian) std::reverse(bytes, bytes + sizeof(T));
        text.append(bytes, sizeof(T));
        return *this;
    }

    PlyEncoding encoding_;
};

ReadMesh readPly(std::string_view bytes) { return test::readEveryWindow(openPly, bytes); }

void addVertexHeader(PlyWriter& ply, int count, PlyType type = PlyType::Float32) {
    ply.header("element vertex " + std::to_string(count));
    for (const char* axis : {"x", "y", "z"}) ply.header(std::string("property ") + nameOf(type) + " " + axis);
}

// A square of four vertices, to be followed by faces.
void addSquare(PlyWriter& ply, PlyType type = PlyType::Float32) {
    for (const auto& v : {std::array{0., 0., 1.}, {1., 0., 2.}, {1., 1., 3.}, {0., 1., 4.}})
        ply.row().values(type, {v[0], v[1], v[2]});
    ply.row();
}

std::string square(PlyEncoding encoding, std::initializer_list<double> face, PlyType count = PlyType::Uint8,
                   PlyType index = PlyType::Int32) {
    PlyWriter ply(encoding);
    addVertexHeader(ply, 4);
    ply.header("element face 1");
    ply.header(std::string("property list ") + nameOf(count) + " " + nameOf(index) + " vertex_indices");
    ply.header("end_header");
    addSquare(ply);
    ply.list(count, index, face).row();
    return ply.text;
}

const std::vector<glm::dvec3> kSquareCorners{{0, 0, 1}, {1, 0, 2}, {1, 1, 3}, {0, 1, 4}};

TEST(Ply, NormalsOfEveryTypeAreDirections) {
    for (const PlyEncoding encoding : kEncodings)
        for (const PlyType type : kTypes) {
            PlyWriter ply(encoding);
            ply.header("element vertex 4");
            for (const char* name : {"x", "y", "z"}) ply.header(std::string("property float ") + name);
            for (const char* name : {"nz", "other", "nx", "ny"})
                ply.header(std::string("property ") + nameOf(type) + " " + name);
            ply.header("element face 1").header("property list uchar int vertex_indices").header("end_header");
            const double normals[4][3] = {{0, 0, 7}, {3, 0, 0}, {0, 0, 0}, {1, 2, 3}};
            for (const auto& n : normals)
                ply.row().values(PlyType::Float32, {n[0], n[1], 1}).values(type, {n[2], 9, n[0], n[1]});
            ply.row().list(PlyType::Uint8, PlyType::Int32, {0, 1, 2}).row();
            const ReadMesh mesh = readPly(ply.text);
            ASSERT_FALSE(mesh.error) << mesh.line();
            EXPECT_EQ(mesh.normals, (std::vector<uint32_t>{packDirection({0, 0, 1}), packDirection({1, 0, 0}),
                                                           kUnknownNormal, packDirection({1, 2, 3})}));
        }
}

TEST(Ply, NormalsThatAreNoneAreUnknown) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
    for (const PlyEncoding encoding : kEncodings) {
        PlyWriter ply(encoding);
        addVertexHeader(ply, 4);
        for (const char* name : {"nx", "ny", "nz"}) ply.header(std::string("property double ") + name);
        ply.header("element face 1").header("property list uchar int vertex_indices").header("end_header");
        const double normals[4][3] = {{nan, 0, 1}, {0, -inf, 0}, {0, 1e308, 0}, {-5e-324, 0, 0}};
        for (const auto& n : normals)
            ply.row().values(PlyType::Float32, {0, 1, 2}).values(PlyType::Float64, {n[0], n[1], n[2]});
        ply.row().list(PlyType::Uint8, PlyType::Int32, {0, 1, 2}).row();
        EXPECT_EQ(readPly(ply.text).normals,
                  (std::vector<uint32_t>{kUnknownNormal, kUnknownNormal, packDirection({0, 1, 0}),
                                         packDirection({1, 0, 0})}));
    }
    // Two of three are not a normal.
    PlyWriter ply(PlyEncoding::Ascii);
    addVertexHeader(ply, 4);
    ply.header("property float nx").header("property float ny");
    ply.header("element face 1").header("property list uchar int vertex_indices").header("end_header");
    for (int i = 0; i < 4; ++i) ply.row().values(PlyType::Float32, {0, 1, 2, 0, 1});
    ply.row().list(PlyType::Uint8, PlyType::Int32, {0, 1, 2}).row();
    EXPECT_TRUE(readPly(ply.text).normals.empty());
}

TEST(Ply, ReadsPositionsOfEveryType) {
    for (const PlyEncoding encoding : kEncodings) {
        for (const PlyType type : kTypes) {
            PlyWriter ply(encoding);
            addVertexHeader(ply, 4, type);
            ply.header("element face 1").header("property list uchar int vertex_index").header("end_header");
            addSquare(ply, type);
            ply.list(PlyType::Uint8, PlyType::Int32, {0, 1, 2}).row();
            const ReadMesh mesh = readPly(ply.text);
            ASSERT_FALSE(mesh.error) << mesh.line();
            EXPECT_EQ(mesh.positions, kSquareCorners) << nameOf(type);
        }
    }
}

TEST(Ply, ReadsListsOfEveryType) {
    for (const PlyEncoding encoding : kEncodings)
        for (const PlyType count : kTypes)
            for (const PlyType index : kTypes) {
                const ReadMesh mesh = readPly(square(encoding, {3, 1, 2}, count, index));
                ASSERT_FALSE(mesh.error) << mesh.line();
                EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{3, 1, 2}})) << nameOf(count) << nameOf(index);
            }
}

TEST(Ply, CutsPolygonsIntoFansAndSkipsThoseWithoutArea) {
    for (const PlyEncoding encoding : kEncodings) {
        EXPECT_EQ(readPly(square(encoding, {2, 3, 0, 1})).triangles, (std::vector<Triangle>{{2, 3, 0}, {2, 0, 1}}));
        for (const auto& face : {std::initializer_list<double>{}, {1}, {1, 2}}) {
            const ReadMesh mesh = readPly(square(encoding, face));
            EXPECT_FALSE(mesh.error) << mesh.line();
            EXPECT_TRUE(mesh.triangles.empty());
        }
    }
}

TEST(Ply, TheItemsOfAPolygonAreNotTakenForTriangles) {
    // Its items, read from one byte on, look like "3, then three vertex numbers".
    for (const PlyEncoding encoding : kEncodings) {
        const ReadMesh mesh = readPly(square(encoding, {3, 0, 0, 0, 0, 1}));
        ASSERT_FALSE(mesh.error) << mesh.line();
        EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{3, 0, 0}, {3, 0, 0}, {3, 0, 0}, {3, 0, 1}}));
    }
}

TEST(Ply, CutsStripsAndRestartsAtMinusOne) {
    for (const PlyEncoding encoding : kEncodings) {
        PlyWriter ply(encoding);
        addVertexHeader(ply, 4);
        ply.header("element tristrips 1").header("property list int int vertex_indices").header("end_header");
        addSquare(ply);
        ply.list(PlyType::Int32, PlyType::Int32, {0, 1, 2, 3, -1, 3, 2, 1, 1, 0}).row();
        const ReadMesh mesh = readPly(ply.text);
        ASSERT_FALSE(mesh.error) << mesh.line();
        // The second strip: 321, then 211 and 110 only steer.
        EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}, {3, 2, 1}}));
    }
}

TEST(Ply, ReadsFacesBeforeVerticesAndSkipsWhatItDoesNotKnow) {
    for (const PlyEncoding encoding : kEncodings) {
        PlyWriter ply(encoding);
        ply.header("comment a comment").header("obj_info a note");
        ply.header("element face 2").header("property uchar flags").header("property list uchar float texcoord");
        ply.header("property list uchar uint vertex_indices").header("property double area");
        ply.header("element edge 2").header("property int from").header("property int to");
        ply.header("element nothing 1000000000000");
        ply.header("element vertex 3").header("property float z").header("property list ushort double weights");
        ply.header("property float x").header("property float nx").header("property float y");
        ply.header("element tag 1").header("property list uchar uchar name").header("end_header");
        for (int face = 0; face < 2; ++face) {
            ply.value(PlyType::Uint8, 7).list(PlyType::Uint8, PlyType::Float32, {.5, .25, .125});
            ply.list(PlyType::Uint8, PlyType::Uint32, {0, 1, 2}).value(PlyType::Float64, 0.5).row();
        }
        ply.values(PlyType::Int32, {0, 1}).row().values(PlyType::Int32, {1, 2}).row();
        for (int v = 0; v < 3; ++v) {
            ply.value(PlyType::Float32, v + 0.5);
            if (v == 1)
                ply.list(PlyType::Uint16, PlyType::Float64, {1, 2, 3, 4});
            else
                ply.list(PlyType::Uint16, PlyType::Float64, {});
            ply.values(PlyType::Float32, {v + 1.5, 9, v + 2.5}).row();
        }
        ply.list(PlyType::Uint8, PlyType::Uint8, {65, 66}).row();
        const ReadMesh mesh = readPly(ply.text);
        ASSERT_FALSE(mesh.error) << mesh.line();
        EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 2}}));
        EXPECT_EQ(mesh.positions, (std::vector<glm::dvec3>{{1.5, 2.5, .5}, {2.5, 3.5, 1.5}, {3.5, 4.5, 2.5}}));
    }
}

struct ColourCase {
    PlyType type;
    std::array<double, 4> values;
    Rgba8 expected;
};

TEST(Ply, ConvertsColoursOfEveryType) {
    const ColourCase cases[] = {
        {PlyType::Uint8, {1, 2, 3, 4}, 0x04030201},      {PlyType::Uint16, {0x1FF, 0x2FF, 0xFFFF, 0}, 0x00FF0201},
        {PlyType::Float32, {0, 0.5, 1, 2}, 0xFFFF8000},  {PlyType::Float64, {-1, 1.0 / 255, 0.25, 1}, 0xFF400100},
        {PlyType::Int32, {-5, 255, 300, 7}, 0x07FFFF00}, {PlyType::Int8, {-5, 127, 0, 1}, 0x01007F00}};
    for (const PlyEncoding encoding : kEncodings)
        for (const ColourCase& c : cases)
            for (const char* prefix : {"", "diffuse_"}) {
                PlyWriter ply(encoding);
                addVertexHeader(ply, 1);
                for (const char* channel : {"red", "green", "blue", "alpha"})
                    ply.header(std::string("property ") + nameOf(c.type) + " " + prefix + channel);
                ply.header("element face 1").header("property list uchar int vertex_indices").header("end_header");
                ply.values(PlyType::Float32, {0, 0, 0});
                for (const double v : c.values) ply.value(c.type, v);
                ply.row().list(PlyType::Uint8, PlyType::Int32, {0, 0, 0}).row();
                const ReadMesh mesh = readPly(ply.text);
                ASSERT_FALSE(mesh.error) << mesh.line();
                ASSERT_TRUE(mesh.info.hasColour);
                EXPECT_EQ(mesh.colours, std::vector<Rgba8>{c.expected}) << nameOf(c.type);
            }
}

TEST(Ply, WithoutAlphaColoursAreOpaque) {
    const ReadMesh mesh = readPly(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\n"
        "property uchar r\nproperty uchar g\nproperty uchar b\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n0 0 0 17 34 51\n3 0 0 0\n");
    ASSERT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.colours, std::vector<Rgba8>{0xFF332211});
}

TEST(Ply, ReadsEveryKindOfLineEnd) {
    const std::string plain = square(PlyEncoding::Ascii, {0, 1, 2, 3});
    for (const char* end : {"\r\n", "\r"}) {
        std::string text;
        for (const char c : plain) c == '\n' ? text += end : text += c;
        const ReadMesh mesh = readPly(text);
        ASSERT_FALSE(mesh.error) << mesh.line();
        EXPECT_EQ(mesh.positions, kSquareCorners);
        EXPECT_EQ(mesh.triangles.size(), 2u);
    }
}

TEST(Ply, ABodyMayBeginWithALineFeed) {
    // With CR line ends only, the first byte of the body must not be taken for the rest of a CRLF.
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        std::string text = "ply" + end + "format binary_little_endian 1.0" + end + "element vertex 1" + end;
        for (const char* axis : {"x", "y", "z"}) text += "property uchar " + std::string(axis) + end;
        text += "element face 1" + end + "property list uchar uchar vertex_index" + end + "end_header" + end;
        text += std::string("\n\n\n\x03\0\0\0", 7);
        const ReadMesh mesh = readPly(text);
        ASSERT_FALSE(mesh.error) << mesh.line();
        EXPECT_EQ(mesh.positions, std::vector<glm::dvec3>{glm::dvec3(10)});
    }
}

TEST(Ply, IgnoresBytesAfterTheLastRow) {
    for (const PlyEncoding encoding : kEncodings) {
        const ReadMesh mesh = readPly(square(encoding, {0, 1, 2}) + "trailing bytes");
        EXPECT_FALSE(mesh.error) << mesh.line();
        EXPECT_EQ(mesh.triangles.size(), 1u);
    }
}

TEST(Ply, ReadsMoreThanAChunkInOneStripAndInManyRows) {
    constexpr int kMany = 200'000;
    for (const PlyEncoding encoding : kEncodings) {
        PlyWriter ply(encoding);
        addVertexHeader(ply, kMany);
        ply.header("element tristrips 1").header("property list uint uint vertex_indices");
        ply.header("element face " + std::to_string(kMany)).header("property list uchar int vertex_indices");
        ply.header("end_header");
        for (int i = 0; i < kMany; ++i) ply.values(PlyType::Float32, {1. * i, 2. * i, 0}).row();
        ply.value(PlyType::Uint32, kMany);
        for (int i = 0; i < kMany; ++i) ply.value(PlyType::Uint32, i);
        ply.row();
        for (int i = 0; i < kMany; ++i)
            ply.list(PlyType::Uint8, PlyType::Int32, {1. * i, 0, (i * 7.0) < kMany ? i * 7.0 : 1.0}).row();
        const ReadMesh mesh = test::readAll(openPly(ByteSource::fromMemory(ply.text, "mesh")));
        ASSERT_FALSE(mesh.error) << mesh.line();
        ASSERT_EQ(mesh.triangles.size(), size_t{2 * kMany - 2});
        EXPECT_EQ(mesh.triangles[kMany - 3], (Triangle{kMany - 2, kMany - 3, kMany - 1}));
        EXPECT_EQ(mesh.triangles.back(), (Triangle{kMany - 1, 0, 1}));
        EXPECT_EQ(mesh.positions[123456], glm::dvec3(123456, 246912, 0));
    }
}

TEST(Ply, AnIndexOutOfRangeNamesFaceAndByte) {
    for (const PlyEncoding encoding : kEncodings) {
        const bool ascii = encoding == PlyEncoding::Ascii;
        for (const double bad : {4.0, -1.0, 2147483647.0}) {
            const std::string text = square(encoding, {0, bad, 2});
            const ReadMesh mesh = readPly(text);
            ASSERT_TRUE(mesh.error);
            EXPECT_EQ(mesh.error->code, ErrorCode::InvalidInput);
            EXPECT_EQ(mesh.error->element, "face 0");
            EXPECT_EQ(mesh.error->byte, ascii ? text.rfind("\n3 0 ") + 5 : text.size() - 8);
        }
        EXPECT_EQ(readPly(square(encoding, {0, 1.5, 2}, PlyType::Uint8, PlyType::Float32)).error->element, "face 0");
    }
}

TEST(Ply, APositionThatIsNotFiniteNamesVertexAndByte) {
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        for (const PlyEncoding encoding : kEncodings)
            for (const PlyType type : {PlyType::Float32, PlyType::Float64})
                for (const bool withList : {false, true}) {
                    PlyWriter ply(encoding);
                    addVertexHeader(ply, 2, type);
                    if (withList) ply.header("property list uchar uchar junk");
                    ply.header("element face 1").header("property list uchar int vertex_indices").header("end_header");
                    const size_t body = ply.text.size();
                    ply.values(type, {0, 0, 0});
                    if (withList) ply.list(PlyType::Uint8, PlyType::Uint8, {1, 2});
                    ply.row().value(type, 0);
                    const size_t at = ply.text.size();
                    ply.values(type, {bad, 0});
                    if (withList) ply.list(PlyType::Uint8, PlyType::Uint8, {});
                    ply.row().list(PlyType::Uint8, PlyType::Int32, {0, 1, 0}).row();
                    ASSERT_GT(at, body);
                    const ReadMesh mesh = readPly(ply.text);
                    ASSERT_TRUE(mesh.error);
                    EXPECT_EQ(mesh.error->element, "vertex 1") << mesh.line();
                    EXPECT_EQ(mesh.error->byte, at) << mesh.line();
                }
}

TEST(Ply, ListLengthsThatLieAreErrors) {
    for (const PlyEncoding encoding : {PlyEncoding::LittleEndian, PlyEncoding::BigEndian})
        for (const double length : {-1.0, 4.0, 2147483647.0}) {
            std::string text = square(encoding, {0, 1, 2}, PlyType::Int32);
            PlyWriter wrong(encoding);
            wrong.text.clear();
            wrong.value(PlyType::Int32, length);
            text.replace(text.size() - 16, 4, wrong.text);
            const ReadMesh mesh = readPly(text);
            ASSERT_TRUE(mesh.error);
            EXPECT_EQ(mesh.error->element, "face 0");
            EXPECT_EQ(mesh.error->byte, text.size() - 16);
        }
    for (const char* length : {"-3", "1e9", "99999999999999999999", "2.5", "x"}) {
        std::string text = square(PlyEncoding::Ascii, {0, 1, 2});
        const size_t at = text.rfind("3 0 1 2");
        text.replace(at, 1, length);
        const ReadMesh mesh = readPly(text);
        ASSERT_TRUE(mesh.error) << length;
        EXPECT_EQ(mesh.error->byte, at) << mesh.line();
    }
}

TEST(Ply, CountsThatLieAreFoundBeforeAnythingIsRead) {
    for (const PlyEncoding encoding : kEncodings)
        for (const char* count : {"5000000", "4000000000", "18446744073709551615"})
            for (const char* element : {"element vertex 4", "element face 1"}) {
                std::string text = square(encoding, {0, 1, 2});
                const size_t at = text.find(element);
                text.replace(at + std::strlen(element) - 1, 1, count);
                const auto opened = openPly(ByteSource::fromMemory(text, "mesh"));
                ASSERT_FALSE(opened.ok()) << element << count;
                EXPECT_EQ(opened.error().code, ErrorCode::InvalidInput);
                EXPECT_TRUE(opened.error().byte.has_value());
                EXPECT_NE(opened.error().element.find(element[8] == 'v' ? "vertex" : "face"), std::string::npos);
            }
}

TEST(Ply, EveryTruncationOfABinaryFileIsAnError) {
    for (const PlyEncoding encoding : {PlyEncoding::LittleEndian, PlyEncoding::BigEndian}) {
        const std::string text = square(encoding, {0, 1, 2, 3});
        ASSERT_FALSE(readPly(text).error);
        for (size_t length = 0; length < text.size(); ++length) {
            const ReadMesh mesh = readPly(std::string_view(text).substr(0, length));
            ASSERT_TRUE(mesh.error) << length;
            EXPECT_EQ(mesh.line().find('\n'), std::string::npos);
            EXPECT_TRUE(mesh.error->byte) << mesh.line();
        }
    }
}

TEST(Ply, EveryTruncationOfATextBeforeItsLastValueIsAnError) {
    const std::string text = square(PlyEncoding::Ascii, {0, 1, 2, 3});
    const size_t lastValue = text.rfind('3') + 1;
    for (size_t length = 0; length < lastValue; ++length)
        EXPECT_TRUE(readPly(std::string_view(text).substr(0, length)).error) << length;
    EXPECT_FALSE(readPly(std::string_view(text).substr(0, lastValue)).error);
}

TEST(Ply, ALineWithTooFewValuesIsFoundInItsRow) {
    std::string text = square(PlyEncoding::Ascii, {0, 1, 2});
    const size_t at = text.find("1 0 2 \n");
    const ReadMesh mesh = readPly(text.replace(at, 7, "1 0\n  "));
    ASSERT_TRUE(mesh.error);
    EXPECT_EQ(mesh.error->element, "vertex 1");
    EXPECT_EQ(mesh.error->byte, at + 3);
}

TEST(Ply, ValuesBeyondTheDeclaredOnesAreIgnored) {
    std::string text = square(PlyEncoding::Ascii, {0, 1, 2});
    const size_t at = text.find("1 0 2 \n");
    const ReadMesh mesh = readPly(text.replace(at, 6, "1 0 2 8 9 10"));
    EXPECT_FALSE(mesh.error) << mesh.line();
    EXPECT_EQ(mesh.positions, kSquareCorners);
}

struct HeaderCase {
    const char* header;
    const char* inMessage;
};

TEST(Ply, BrokenHeadersAreNamed) {
    const HeaderCase cases[] = {
        {"plx\n", "not a PLY file"},
        {"ply format ascii 1.0\n", "line of its own"},
        {"ply\nend_header\n", "no 'format'"},
        {"ply\nformat ascii 2.0\nend_header\n", "expected 'format"},
        {"ply\nformat utf8 1.0\nend_header\n", "unknown encoding"},
        {"ply\nformat ascii 1.0\nformat ascii 1.0\nend_header\n", "second 'format'"},
        {"ply\nformat ascii 1.0\nproperty float x\nend_header\n", "before the first element"},
        {"ply\nformat ascii 1.0\nelement vertex -1\nend_header\n", "not a count"},
        {"ply\nformat ascii 1.0\nelement vertex 1e3\nend_header\n", "not a count"},
        {"ply\nformat ascii 1.0\nelement vertex 18446744073709551616\nend_header\n", "not a count"},
        {"ply\nformat ascii 1.0\nelement vertex\nend_header\n", "expected 'element"},
        {"ply\nformat ascii 1.0\nelement a 1\nelement a 1\nend_header\n", "a second element"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\nend_header\n", "unknown type 'half'"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar x\nend_header\n", "expected 'property list"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty list set int x\nend_header\n", "unknown type 'set'"},
        {"ply\nformat ascii 1.0\nnonsense\nend_header\n", "not a PLY header keyword"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n", "ends inside the header"},
        {"ply\nformat ascii 1.0\nelement face 1\nend_header\n", "has no vertices"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nend_header\n", "has no faces"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nelement face 0\nend_header\n", "has no faces"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty list int int y\nelement face 1\n"
         "property list int int vertex_indices\nend_header\n0 0\n0\n",
         "no scalar property 'y'"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\nelement face 1\n"
         "property int vertex_indices\nend_header\n0 0 0\n0\n",
         "no list property"},
    };
    for (const HeaderCase& c : cases) {
        const ReadMesh mesh = readPly(c.header);
        ASSERT_TRUE(mesh.error) << c.header;
        EXPECT_NE(mesh.line().find(c.inMessage), std::string::npos) << mesh.line();
    }
}

TEST(Ply, AHeaderWithoutEndIsLimited) {
    std::string text = "ply\nformat ascii 1.0\n";
    while (text.size() < 3'000'000) text += "comment " + std::string(1000, 'x') + "\n";
    const auto opened = openPly(ByteSource::fromMemory(text, "mesh"));
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, ErrorCode::Limit);

    std::string elements = "ply\nformat ascii 1.0\n";
    for (int i = 0; i < 5000; ++i) elements += "element e" + std::to_string(i) + " 1\n";
    EXPECT_EQ(openPly(ByteSource::fromMemory(elements, "mesh")).error().code, ErrorCode::Limit);
}

TEST(Ply, EverySingleBitFlipIsReadOrRefused) {
    for (const PlyEncoding encoding : kEncodings) {
        const std::string text = square(encoding, {0, 1, 2, 3});
        for (size_t bit = 0; bit < 8 * text.size(); ++bit) {
            std::string flipped = text;
            flipped[bit / 8] = char(flipped[bit / 8] ^ (1 << bit % 8));
            const ReadMesh mesh = test::readAll(openPly(ByteSource::fromMemory(flipped, "mesh", 32)));
            EXPECT_EQ(mesh.line().find('\n'), std::string::npos) << mesh.line();
            EXPECT_LE(mesh.triangles.size(), flipped.size());
        }
    }
}

}  // namespace
}  // namespace vcp
