// The page codec: every page comes back as it was, but for the order of its parts; what is not a page of the
// builder's kind is stored plainly; hostile bytes are refused or decode to something of the size that was asked for.
#include "octree/page/page_codec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "octree/io/content_hash.h"
#include "octree/surface/leaf_triangles.h"
#include "tests/support/analytic_page.h"
#include "tests/support/mixed_page.h"
#include "tests/support/soup_page.h"

namespace vcp {
namespace {

using test::asBytes, test::Block, test::randomColours, test::sheet, test::soup, test::SoupPage, test::WholePage,
    test::withLeavesOfAllKinds;

constexpr std::byte kPlain{0}, kCoded{1}, kMarked{2};

/// A vertex with all that belongs to it; triangles as sorted triples of them.
using Vertex = std::array<uint32_t, 7>;
using Triangle = std::array<Vertex, 3>;

std::vector<Triangle> trianglesOf(const PageView& page, uint32_t word) {
    std::vector<Triangle> triangles;
    forEachTriangle(page.strips, word, [&](const Index3& vertices) {
        Triangle t;
        for (size_t i = 0; i < 3; ++i) {
            const uint32_t v = vertices[i];
            const TexturePoint point = page.points.empty() ? TexturePoint{} : page.points[v];
            t[i] = {page.vertices[v].x, page.vertices[v].y,
                    page.normals[v],    page.vertexColours.empty() ? 0 : page.vertexColours[v],
                    uint32_t(point.u),  uint32_t(point.v),
                    point.material};
        }
        std::sort(t.begin(), t.end());
        triangles.push_back(t);
    });
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

void expectSameNode(const PageView& a, uint32_t wordA, const PageView& b, uint32_t wordB) {
    ASSERT_EQ(nodeType(wordA), nodeType(wordB));
    if (nodeType(wordA) == kNodeHard) {
        ASSERT_EQ(trianglesOf(a, wordA), trianglesOf(b, wordB));
        return;
    }
    if (nodeType(wordA) == kNodeInternal) {
        for (uint32_t o = 0; o < 8 && !testing::Test::HasFatalFailure(); ++o)
            expectSameNode(a, a.nodes[8 * wordA + o], b, b.nodes[8 * wordB + o]);
        return;
    }
    if (nodeType(wordA) == kNodeEmpty) {
        ASSERT_EQ(wordA, wordB);
        return;
    }
    if (nodeType(wordA) == kNodeSlab) {
        ASSERT_EQ(slabOctants(wordA), slabOctants(wordB));
        ASSERT_EQ(isOpenSlab(wordA), isOpenSlab(wordB));
        ASSERT_EQ(vectorWord(a.faces, slabVector(wordA)), vectorWord(b.faces, slabVector(wordB)));
        if (!a.faceColours.empty()) {
            ASSERT_EQ(vectorWord(a.faceColours, slabVector(wordA)), vectorWord(b.faceColours, slabVector(wordB)));
        }
        return;
    }
    ASSERT_EQ(wordA & ~kLeafIndexMask, wordB & ~kLeafIndexMask);
    for (uint32_t end = 0; end < 2; ++end) {
        const uint32_t faceA = (wordA & kLeafIndexMask) + end, faceB = (wordB & kLeafIndexMask) + end;
        ASSERT_EQ(a.faces[faceA], b.faces[faceB]);
        if (!a.faceColours.empty()) {
            ASSERT_EQ(a.faceColours[faceA], b.faceColours[faceB]);
        }
    }
}

void expectSamePage(const PageView& a, const PageView& b) {
    PageHeader header = b.header;
    header.root = a.header.root;
    header.entries = a.header.entries;  // another order of the triangles gives other strips
    ASSERT_EQ(std::memcmp(&a.header, &header, sizeof header), 0);
    expectSameNode(a, a.header.root, b, b.header.root);
}

WholePage unpack(const PackedPage& packed, const WholePage& like) {
    WholePage page;
    auto geometry = unpackGeometry(packed.geometry, packed.geometryBytes);
    EXPECT_TRUE(geometry.ok()) << geometry.error().line();
    page.geometry = *std::move(geometry);
    const auto view = parsePage(asBytes(page.geometry));
    EXPECT_TRUE(view.ok()) << view.error().line();
    if (like.colour.empty()) return page;
    auto colour = unpackColour(packed.colour, like.colour.size() * 16, *view);
    EXPECT_TRUE(colour.ok()) << colour.error().line();
    page.colour = *std::move(colour);
    return page;
}

void expectRoundTrip(const WholePage& page, std::byte form) {
    ASSERT_TRUE(parsePage(asBytes(page.geometry), asBytes(page.colour)).ok());
    const PackedPage packed = packPage(asBytes(page.geometry), asBytes(page.colour));
    ASSERT_FALSE(packed.geometry.empty());
    EXPECT_EQ(packed.geometry[0], form);
    const WholePage back = unpack(packed, page);
    expectSamePage(page.view(), back.view());
    // What comes back is in the codec's order already, and the same page costs the same bytes.
    const PackedPage again = packPage(asBytes(page.geometry), asBytes(page.colour));
    EXPECT_EQ(again.geometry, packed.geometry);
    EXPECT_EQ(again.colour, packed.colour);
    expectSamePage(page.view(), unpack(packPage(asBytes(back.geometry), asBytes(back.colour)), page).view());
}

WholePage analyticPage(const test::SignedDistanceField& field, uint32_t log2Cells, uint32_t axis) {
    return {test::AnalyticPageBuilder(field, glm::dvec3(0), 1, log2Cells, axis, 0.05f, 3).build().bytes.geometry, {}};
}

TEST(PageCodec, ADraftIsItsPage) {
    for (const uint32_t seed : {1u, 2u, 3u}) {
        const WholePage page = withLeavesOfAllKinds(soup(seed, 2, 3, 20, 10).build(seed), seed);
        PageDraft draft = draftOf(page.view());
        EXPECT_EQ(draft.lists.triangles.size(), draft.lists.begin.back());
        const std::vector<std::byte> whole = pageOf(draft);
        const auto view = parsePage(whole, asBytes(page.colour));
        ASSERT_TRUE(view.ok()) << view.error().line();
        expectSamePage(page.view(), *view);
        const auto packed = packPage(draft, asBytes(page.colour));
        ASSERT_TRUE(packed.ok()) << packed.error().line();
        EXPECT_EQ(packed->geometry, packPage(asBytes(page.geometry), asBytes(page.colour)).geometry);
        draft.header.log2Cells = 0;
        EXPECT_FALSE(packPage(draft, {}).ok()) << "there is no such page";
    }
}

TEST(PageCodec, SoftPagesComeBack) {
    for (uint32_t log2Cells = 1; log2Cells <= 5; ++log2Cells)
        for (uint32_t axis = 0; axis < 3; ++axis) {
            SCOPED_TRACE(log2Cells * 10 + axis);
            const double n = std::exp2(log2Cells);
            for (const auto& field :
                 {test::sphere(glm::dvec3(n * 0.45), n * 0.4), test::plane(glm::normalize(glm::dvec3(1, 2, 3)), n),
                  test::torus(glm::dvec3(n * 0.5), n * 0.3, n * 0.11)}) {
                WholePage page = analyticPage(field, log2Cells, axis);
                expectRoundTrip(page, kCoded);
                page.colour = randomColours(page.view(), log2Cells);
                expectRoundTrip(page, kCoded);
            }
        }
}

TEST(PageCodec, TriangleSoupsComeBack) {
    for (uint32_t seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const uint32_t log2Cells = 1 + seed % 3, depth = log2Cells + seed % (kMaxSubcellDepth + 1);
        expectRoundTrip(
            soup(seed, log2Cells, std::min(depth, 4u), 8 + uint32_t(random() % 30), 1 + uint32_t(random() % 40))
                .build(seed),
            kCoded);
    }
}

TEST(PageCodec, SheetsComeBack) {
    for (uint32_t seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE(seed);
        expectRoundTrip(sheet(seed, 2, 2 + seed % 2, 4 + seed).build(seed), kCoded);
    }
}

WholePage slabPage(const test::SignedDistanceField& field, uint32_t log2Cells) {
    return {test::SlabPageBuilder(field, glm::dvec3(0), 1, log2Cells, 0.05f).build(), {}};
}

TEST(PageCodec, SlabPagesComeBack) {
    for (uint32_t log2Cells = 1; log2Cells <= 5; ++log2Cells) {
        SCOPED_TRACE(log2Cells);
        const double n = std::exp2(log2Cells);
        for (const auto& field :
             {test::sphere(glm::dvec3(n * 0.45), n * 0.4), test::plane(glm::normalize(glm::dvec3(1, 2, 3)), n),
              test::torus(glm::dvec3(n * 0.5), n * 0.3, n * 0.11)}) {
            WholePage page = slabPage(field, log2Cells);
            ASSERT_GT(page.view().header.slabLeaves, 0u);
            expectRoundTrip(page, kCoded);
            page.colour = randomColours(page.view(), log2Cells);
            auto* words = reinterpret_cast<uint32_t*>(page.colour.data());
            std::fill(words + page.view().header.slabLeaves, words + 4 * page.view().header.faces, 0u);
            expectRoundTrip(page, kCoded);
        }
    }
}

TEST(PageCodec, LeavesOfAllKindsComeBack) {
    for (uint32_t seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE(seed);
        const WholePage page =
            withLeavesOfAllKinds(soup(seed, 1 + seed % 3, 1 + seed % 4, 20, 1 + seed % 20).build(seed), seed);
        const PageHeader header = page.view().header;
        EXPECT_GT(header.hardLeaves, 0u);
        expectRoundTrip(page, kCoded);
    }
    // A leaf alone is a page.
    PageHeader header;
    header.log2Cells = 3;
    header.root = slabNode(0x81, 0);
    header.slabLeaves = header.faces = 1;
    WholePage page{Block(pageSections(header).end / 16, uint4(0)), {}};
    std::memcpy(page.geometry.data(), &header, sizeof header);
    page.geometry.back() = uint4(0x12345678, 0, 0, 0);
    expectRoundTrip(page, kCoded);
}

TEST(PageCodec, SlabsOfASmoothSurfaceCostLittle) {
    const WholePage page = slabPage(test::sphere({15.2, 16.1, 15.7}, 12), 5);
    const size_t bytes = packPage(asBytes(page.geometry), {}).geometry.size();
    EXPECT_LT(bytes, size_t{4} * page.view().header.slabLeaves);
}

TEST(PageCodec, LongLeavesComeBack) {
    // One leaf with 62, 63 and 300 triangles: both forms of the count.
    for (const uint32_t count : {62u, 63u, 300u}) {
        SCOPED_TRACE(count);
        expectRoundTrip(soup(count, 1, 0, 40, count).build(count), kCoded);
    }
}

TEST(PageCodec, EmptyPageComesBack) {
    PageHeader header;
    header.log2Cells = 5;
    header.root = emptyNode(0);
    WholePage page{Block(sizeof header / 16), {}};
    std::memcpy(page.geometry.data(), &header, sizeof header);
    expectRoundTrip(page, kCoded);
    EXPECT_LT(packPage(asBytes(page.geometry), {}).geometry.size(), 24u);
}

TEST(PageCodec, PagesOfAnotherKindAreStoredPlainly) {
    // A leaf without one of the triangles that touch it.
    SoupPage lacking = soup(5, 2, 2, 20, 30);
    lacking.forgetATriangle = true;
    expectRoundTrip(lacking.build(5), kPlain);
    EXPECT_FALSE(lacking.forgetATriangle);

    // Edges longer than a page can hold.
    SoupPage large(7, 0);
    const int far = kMaxEdgeSteps / 2 + 1000;
    large.triangle(large.vertex({-far, 0, 0}), large.vertex({far, 0, 0}), large.vertex({0, far, 0}));
    expectRoundTrip(large.build(1), kPlain);

    // A vertex that no triangle has.
    WholePage page = analyticPage(test::sphere({2, 2, 2}, 1.5), 2, 0);
    PageHeader header = page.view().header;
    header.vertices = 1;
    page.geometry.resize(pageSections(header).end / 16, uint4(7));
    std::memcpy(page.geometry.data(), &header, sizeof header);
    expectRoundTrip(page, kPlain);

    // A face that no leaf has.
    page = analyticPage(test::sphere({2, 2, 2}, 1.5), 2, 0);
    header = page.view().header;
    ++header.faces;
    page.geometry.resize(pageSections(header).end / 16, uint4(7));
    std::memcpy(page.geometry.data(), &header, sizeof header);
    expectRoundTrip(page, kPlain);
}

/// Gives open marks to vertices and slab leaves. `isOpen(number, position)`: of a vertex, and of a slab's vector.
WholePage marked(WholePage page, const std::function<bool(uint32_t, glm::u32vec3)>& isOpen) {
    const PageView view = page.view();
    const PageSections s = pageSections(view.header);
    auto* bytes = reinterpret_cast<std::byte*>(page.geometry.data());
    auto* vertices = reinterpret_cast<glm::u32vec2*>(bytes + s.vertices);
    auto* nodes = reinterpret_cast<uint32_t*>(bytes + s.nodes);
    for (uint32_t v = 0; v < view.header.vertices; ++v)
        if (isOpen(v, unpack21(vertices[v]))) vertices[v].y |= kVertexOpenBit;
    for (uint32_t i = 0; i < 8 * view.header.groups; ++i)
        if (nodeType(nodes[i]) == kNodeSlab && isOpen(slabVector(nodes[i]), {})) nodes[i] |= kSlabOpenBit;
    return page;
}

TEST(PageCodec, OpenMarksComeBack) {
    // Two sheets that share no vertex, of which one is open; and all kinds of leaves, every third slab open.
    SoupPage two(3, 3);
    for (int sheet = 0; sheet < 2; ++sheet)
        for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 8; ++x) {
                const auto vertex = [&](int i, int j) {
                    return two.vertex({1800 * i + 300, 1800 * j + 300, 4000 + 5000 * sheet + 40 * i * j});
                };
                const uint32_t a = vertex(x, y), b = vertex(x + 1, y), c = vertex(x, y + 1);
                two.triangle(a, b, c);
            }
    const WholePage unmarked = two.build(7);
    const auto isHigh = [](uint32_t, glm::u32vec3 p) { return int(p.z) - kLatticeBias > 7500; };
    const WholePage page = marked(unmarked, isHigh);
    expectRoundTrip(page, kMarked);
    expectRoundTrip(marked(sheet(1, 2, 3, 9).build(1), [](uint32_t, glm::u32vec3) { return true; }), kMarked);
    const WholePage kinds =
        marked(withLeavesOfAllKinds(soup(5, 2, 3, 20, 10).build(5), 5),
               [](uint32_t number, glm::u32vec3 p) { return p == glm::u32vec3(0) && number % 3 == 0; });
    expectRoundTrip(kinds, kMarked);
    // The marks are in the bytes that come back, and all else is as without them.
    const PackedPage packed = packPage(asBytes(page.geometry), {});
    const WholePage back = unpack(packed, {page.geometry, {}});
    uint32_t open = 0;
    for (const glm::u32vec2 vertex : back.view().vertices) {
        EXPECT_EQ(isOpenVertex(vertex), isHigh(0, unpack21(vertex)));
        open += isOpenVertex(vertex) ? 1 : 0;
    }
    EXPECT_EQ(open, page.view().header.vertices / 2);
    // A sheet of ever so many triangles has one mark.
    const WholePage whole = sheet(1, 2, 3, 9).build(1);
    const size_t without = packPage(asBytes(whole.geometry), {}).geometry.size();
    const size_t with =
        packPage(asBytes(marked(whole, [](uint32_t, glm::u32vec3) { return true; }).geometry), {}).geometry.size();
    EXPECT_LE(with, without + 2);
    // No triangle is open in a part.
    expectRoundTrip(marked(unmarked, [](uint32_t number, glm::u32vec3) { return number % 2 == 0; }), kPlain);
}

/// Gives a page's vertices colours, and places in images. `pointOf(number, position)`: a vertex's.
WholePage textured(WholePage page, const std::function<TexturePoint(uint32_t, glm::ivec3)>& pointOf) {
    const PageHeader header = page.view().header;
    page.colour = randomColours(page.view(), 3);
    const size_t coloured = size_t{16} * header.faces + size_t{4} * header.vertices;
    page.colour.resize(texturedPageBytes(header) / 16, uint4(0));
    std::vector<TexturePoint> points;
    for (uint32_t v = 0; v < header.vertices; ++v)
        points.push_back(
            pointOf(v, glm::ivec3(unpack21(parsePage(asBytes(page.geometry))->vertices[v])) - kLatticeBias));
    std::memcpy(reinterpret_cast<std::byte*>(page.colour.data()) + coloured, points.data(),
                points.size() * sizeof(TexturePoint));
    return page;
}

TEST(PageCodec, TexturedPagesComeBack) {
    const auto flat = [](uint32_t, glm::ivec3 p) { return TexturePoint{9 * p.x + 2 * p.y, 7 * p.y - p.x, 4}; };
    const WholePage page = textured(sheet(1, 2, 3, 9).build(1), flat);
    expectRoundTrip(page, kCoded);
    EXPECT_EQ(packPage(asBytes(page.geometry), asBytes(page.colour)).colour[0], std::byte{3});
    for (uint32_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        // Any coordinates at all, on grids of several steps, the largest and the smallest numbers among them.
        const int shift = int(seed % 17);
        const auto any = [&](uint32_t, glm::ivec3) {
            const auto coordinate = [&] { return int32_t(uint32_t(random()) >> random() % 32 << shift); };
            return TexturePoint{coordinate(), coordinate(), 1 + seed};
        };
        expectRoundTrip(textured(soup(seed, 1 + seed % 3, 1 + seed % 4, 20, 1 + seed % 20).build(seed), any), kCoded);
        expectRoundTrip(textured(sheet(seed, 2, 3, 4 + seed % 9).build(seed), any), kCoded);
    }
    // Beside leaves of other kinds; and two sheets of which one has no image.
    expectRoundTrip(textured(withLeavesOfAllKinds(soup(5, 2, 3, 20, 10).build(5), 5), flat), kCoded);
    SoupPage two(3, 3);
    for (int sheet = 0; sheet < 2; ++sheet)
        for (int x = 0; x < 8; ++x)
            two.triangle(two.vertex({1800 * x, 300, 5000 * sheet}), two.vertex({1800 * x + 900, 300, 5000 * sheet}),
                         two.vertex({1800 * x, 1300, 5000 * sheet}));
    expectRoundTrip(textured(two.build(7),
                             [](uint32_t, glm::ivec3 p) {
                                 return p.z > 2000 ? TexturePoint{p.x, p.y, 77} : TexturePoint{};
                             }),
                    kCoded);
}

TEST(PageCodec, WhatIsNoTexturedPageOfTheBuilderIsStoredPlainly) {
    const auto formOf = [](const WholePage& page) {
        expectRoundTrip(page, kPlain);
        return packPage(asBytes(page.geometry), asBytes(page.colour)).colour[0];
    };
    const WholePage page = sheet(1, 2, 3, 9).build(1);
    EXPECT_EQ(formOf(textured(page,
                              [](uint32_t v, glm::ivec3) {
                                  return TexturePoint{0, 0, v % 2};
                              })),
              kPlain)
        << "two materials in one triangle";
    EXPECT_EQ(formOf(textured(page,
                              [](uint32_t, glm::ivec3) {
                                  return TexturePoint{0, 7, 0};
                              })),
              kPlain)
        << "coordinates without an image";
}

TEST(PageCodec, CoordinatesAreForetold) {
    // An image lies over a sheet that is bent, without being stretched; and over one that is nearly flat, cut anywhere.
    const auto bytesOf = [](const WholePage& page, uint32_t vertices) {
        const auto packed = packPage(asBytes(page.geometry), asBytes(page.colour));
        const auto without =
            packPage(asBytes(page.geometry), asBytes(page.colour).first(colourPageBytes(page.view().header)));
        return double(packed.colour.size() - without.colour.size()) / vertices;
    };
    SoupPage roof(4, 3);
    std::mt19937 random(5);
    std::map<std::pair<int, int>, uint32_t> numbers;
    const auto vertex = [&](int i, int j) {
        const auto [at, isNew] = numbers.try_emplace({i, j}, 0);
        if (isNew) at->second = roof.vertex({1000 * i, 1000 * j, i < 8 ? 0 : 750 * (i - 8)});
        return at->second;
    };
    for (int j = 0; j < 16; ++j)
        for (int i = 0; i < 16; ++i) {
            roof.triangle(vertex(i, j), vertex(i + 1, j), vertex(i, j + 1));
            roof.triangle(vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
        }
    const auto along = [](uint32_t, glm::ivec3 p) {
        const int x = p.x <= 8000 ? p.x : 8000 + (p.x - 8000) / 4 * 5;
        return TexturePoint{3 * x + 1, 3 * p.y, 1};
    };
    EXPECT_LT(bytesOf(textured(roof.build(2), along), 17 * 17), 0.5);
}

TEST(PageCodec, SmoothSurfaceCostsLittle) {
    // A soft leaf of the sphere takes 20 to 25 bytes in memory; its vectors are foretold to a few steps.
    const WholePage page = analyticPage(test::sphere({15.2, 16.1, 15.7}, 12), 5, 2);
    const size_t bytes = packPage(asBytes(page.geometry), {}).geometry.size();
    EXPECT_LT(bytes, size_t{5} * page.view().header.softLeaves);
    EXPECT_LT(bytes * 5, page.geometry.size() * 16);
}

// Else files written before can no longer be read: raise kFileVersion.
TEST(PageCodec, GoldenBytes) {
    const WholePage soft = analyticPage(test::sphere({7.2, 8.1, 7.7}, 6), 4, 1), hard = sheet(1, 2, 3, 9).build(1);
    const PackedPage a = packPage(asBytes(soft.geometry), {}),
                     b = packPage(asBytes(hard.geometry), asBytes(hard.colour));
    EXPECT_EQ(hashBytes(a.geometry), 17991366014534821996u);
    EXPECT_EQ(hashBytes(b.geometry), 6557190735201215753u);
    EXPECT_EQ(hashBytes(b.colour), 14017639361795138587u);
    const WholePage open = marked(hard, [](uint32_t, glm::u32vec3) { return true; });
    EXPECT_EQ(hashBytes(packPage(asBytes(open.geometry), {}).geometry), 12393540471231443454u);
}

/// Decodes hostile bytes: refused, or of the size that was asked for.
bool decodes(std::span<const std::byte> bytes, uint64_t pageBytes) {
    const auto geometry = unpackGeometry(bytes, pageBytes);
    if (!geometry.ok()) {
        EXPECT_FALSE(geometry.error().message.empty());
        return false;
    }
    EXPECT_EQ(geometry->size() * 16, pageBytes);
    static_cast<void>(parsePage(asBytes(*geometry)));
    return true;
}

TEST(PageCodec, EveryTruncationIsRefused) {
    const WholePage page = sheet(2, 2, 3, 8).build(2);
    const PackedPage packed = packPage(asBytes(page.geometry), asBytes(page.colour));
    for (size_t size = 0; size < packed.geometry.size(); ++size) {
        // A copy of its own, so that a read behind the end is seen.
        const std::vector<std::byte> part(packed.geometry.begin(), packed.geometry.begin() + std::ptrdiff_t(size));
        // The last bytes may be rounding that a decoder does not need.
        const bool decoded = decodes(part, packed.geometryBytes);
        EXPECT_TRUE(!decoded || size + 4 >= packed.geometry.size()) << size;
    }
    std::vector<std::byte> longer = packed.geometry;
    longer.resize(longer.size() + 16, std::byte{1});
    EXPECT_FALSE(decodes(longer, packed.geometryBytes));
    // Sizes that are no page's, for both forms.
    for (const std::byte form : {kPlain, kCoded, kMarked})
        for (const uint64_t bytes : {0u, 1u, 8u, 63u, 72u, 1000u}) {
            std::vector<std::byte> other = packed.geometry;
            other[0] = form;
            EXPECT_FALSE(unpackGeometry(other, bytes).ok()) << bytes;
        }
    for (const int64_t more : {-16, -8, 8, 16})
        EXPECT_FALSE(unpackGeometry(packed.geometry, packed.geometryBytes + uint64_t(more)).ok()) << more;
    EXPECT_FALSE(unpackColour(packed.colour, page.colour.size() * 16 + 16, page.view()).ok());
    EXPECT_FALSE(unpackColour({}, page.colour.size() * 16, page.view()).ok());
}

TEST(PageCodec, HostileBytesAreHarmless) {
    for (const WholePage& page :
         {sheet(3, 2, 3, 8).build(3), soup(4, 2, 4, 20, 25).build(4), analyticPage(test::sphere({4, 4, 4}, 3), 3, 0),
          slabPage(test::sphere({4, 4, 4}, 3), 3), withLeavesOfAllKinds(soup(5, 2, 3, 20, 10).build(5), 5),
          marked(withLeavesOfAllKinds(sheet(6, 2, 3, 8).build(6), 6), [](uint32_t, glm::u32vec3) { return true; })}) {
        const PackedPage packed = packPage(asBytes(page.geometry), asBytes(page.colour));
        std::mt19937 random(11);
        for (int i = 0; i < 3000; ++i) {
            std::vector<std::byte> bytes = packed.geometry;
            // Mostly behind the counts, which lie in the first bytes of either stream.
            for (auto k = 1 + random() % 3; k > 0; --k)
                bytes[1 + random() % (bytes.size() - 1)] ^= std::byte(1u << random() % 8);
            decodes(bytes, packed.geometryBytes);
            if (page.colour.empty()) continue;
            std::vector<std::byte> colour = packed.colour;
            colour[1 + random() % (colour.size() - 1)] ^= std::byte(1u << random() % 8);
            const auto decoded =
                unpackColour(colour, page.colour.size() * 16,
                             *parsePage(asBytes(*unpackGeometry(packed.geometry, packed.geometryBytes))));
            EXPECT_TRUE(!decoded.ok() || decoded->size() == page.colour.size());
        }
        for (int i = 0; i < 3000; ++i) {
            std::vector<std::byte> bytes(random() % 400);
            for (std::byte& b : bytes) b = std::byte(random());
            if (!bytes.empty()) bytes[0] = kCoded;
            decodes(bytes, packed.geometryBytes);
        }
    }
}

}  // namespace
}  // namespace vcp
