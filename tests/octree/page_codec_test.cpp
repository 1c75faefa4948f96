// The page codec: every page comes back as it was, but for the order of its parts; what is not a page of the
// builder's kind is stored plainly; hostile bytes are refused or decode to something of the size that was asked for.
#include "octree/page_codec.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "octree/leaf_triangles.h"
#include "octree/vertex_normal.h"
#include "tests/octree/analytic_page.h"

namespace vcp {
namespace {

using Block = std::vector<uint4>;
constexpr std::byte kPlain{0}, kCoded{1};

std::span<const std::byte> asBytes(const Block& block) { return std::as_bytes(std::span(block)); }

struct WholePage {
    Block geometry, colour;
    [[nodiscard]] PageView view() const { return *parsePage(asBytes(geometry), asBytes(colour)); }
};

/// A vertex with all that belongs to it; triangles as sorted triples of them.
using Vertex = std::array<uint32_t, 4>;
using Triangle = std::array<Vertex, 3>;

std::vector<Triangle> trianglesOf(const PageView& page, uint32_t word) {
    std::vector<Triangle> triangles;
    const TriangleRange range = hardLeafTriangles(page, word);
    for (uint32_t r = range.first; r < range.first + range.count; ++r) {
        const glm::u32vec2 record = page.triangles[r];
        Triangle t;
        const uint32_t vertices[] = {f64::decodeIndex0(record.x), f64::decodeIndex1(record.x, record.y), f64::decodeIndex2(record.y)};
        for (size_t i = 0; i < 3; ++i) {
            const uint32_t v = vertices[i];
            t[i] = {page.vertices[v].x, page.vertices[v].y, page.normals[v], page.vertexColours.empty() ? 0 : page.vertexColours[v]};
        }
        std::sort(t.begin(), t.end());
        triangles.push_back(t);
    }
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
        for (uint32_t o = 0; o < 8 && !testing::Test::HasFatalFailure(); ++o) expectSameNode(a, a.nodes[8 * wordA + o], b, b.nodes[8 * wordB + o]);
        return;
    }
    if (nodeType(wordA) == kNodeEmpty) {
        ASSERT_EQ(wordA, wordB);
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
    ASSERT_EQ(std::memcmp(&a.header, &header, sizeof header), 0);
    expectSameNode(a, a.header.root, b, b.header.root);
}

WholePage unpack(const PackedPage& packed, const WholePage& like) {
    WholePage page;
    auto geometry = unpackGeometry(packed.geometry, like.geometry.size() * 16);
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

Block randomColours(const PageView& page, uint32_t seed) {
    std::mt19937 random(seed);
    Block colours(colourPageBytes(page.header) / 16, uint4(0));
    auto* bytes = reinterpret_cast<uint8_t*>(colours.data());
    const size_t used = size_t{16} * page.header.faces + size_t{4} * page.header.vertices;
    for (size_t i = 0; i < used; ++i) bytes[i] = static_cast<uint8_t>(i % 4 == 3 ? 255 : 100 + random() % 40);
    return colours;
}

WholePage analyticPage(const test::SignedDistanceField& field, uint32_t log2Cells, uint32_t axis) {
    return {test::AnalyticPageBuilder(field, glm::dvec3(0), 1, log2Cells, axis, 0.05f, 3).build().bytes.geometry, {}};
}

/// Whether a closed triangle touches a closed cube: for certain, or perhaps (clipped with a little room).
struct Touch {
    bool certain, perhaps;
};
Touch clipped(const std::array<glm::i32vec3, 3>& t, glm::i32vec3 lower, int edge) {
    const auto meets = [&](double room) {
        std::vector<glm::dvec3> polygon(t.begin(), t.end());
        for (int plane = 0; plane < 6 && !polygon.empty(); ++plane) {
            const int axis = plane / 2;
            const double side = plane % 2 != 0 ? 1 : -1;
            const double limit = (side > 0 ? lower[axis] + edge : -lower[axis]) + room;
            std::vector<glm::dvec3> kept;
            for (size_t i = 0; i < polygon.size(); ++i) {
                const glm::dvec3 p = polygon[i], q = polygon[(i + 1) % polygon.size()];
                const double dp = limit - side * p[axis], dq = limit - side * q[axis];
                if (dp >= 0) kept.push_back(p);
                if ((dp >= 0) != (dq >= 0)) kept.push_back(p + (q - p) * (dp / (dp - dq)));
            }
            polygon = kept;
        }
        return !polygon.empty();
    };
    return {meets(-1e-6), meets(1e-6)};
}

TEST(CubeTest, AgreesWithClipping) {
    std::mt19937 random(3);
    size_t touching = 0, apart = 0;
    for (int i = 0; i < 60000; ++i) {
        SCOPED_TRACE(i);
        const int range = 1 << (2 + i % 10);
        const auto any = [&] { return static_cast<int>(random() % static_cast<unsigned>(2 * range)) - range; };
        const std::array<glm::i32vec3, 3> t{glm::i32vec3(any(), any(), any()), glm::i32vec3(any(), any(), any()), glm::i32vec3(any(), any(), any())};
        const glm::i32vec3 lower(any(), any(), any());
        const int edge = 1 + static_cast<int>(random() % static_cast<unsigned>(range));
        const Touch expected = clipped(t, lower, edge);
        // The bounding boxes must overlap.
        bool boxes = true;
        for (int axis = 0; axis < 3; ++axis)
            boxes = boxes && std::min({t[0][axis], t[1][axis], t[2][axis]}) <= lower[axis] + edge && std::max({t[0][axis], t[1][axis], t[2][axis]}) >= lower[axis];
        if (!boxes) continue;
        const bool touches = CubeTest(t).touches(lower, edge);
        ASSERT_TRUE(touches || !expected.certain);
        ASSERT_TRUE(!touches || expected.perhaps);
        ++(touches ? touching : apart);
    }
    EXPECT_GT(touching, 5000u);
    EXPECT_GT(apart, 5000u);
}

TEST(CubeTest, TouchingCounts) {
    const int e = 256;
    const glm::i32vec3 o(512, 512, 512);
    // In the plane of a face; at a corner; along an edge; a step away from each.
    EXPECT_TRUE(CubeTest({glm::i32vec3(768, 0, 0), {768, 2000, 0}, {768, 0, 2000}}).touches(o, e));
    EXPECT_FALSE(CubeTest({glm::i32vec3(769, 0, 0), {769, 2000, 0}, {769, 0, 2000}}).touches({513, 512, 512}, 255));
    EXPECT_TRUE(CubeTest({glm::i32vec3(768 * 3, 0, 0), {0, 768 * 3, 0}, {0, 0, 768 * 3}}).touches(o, e));
    EXPECT_FALSE(CubeTest({glm::i32vec3(768 * 3 + 1, 0, 0), {0, 768 * 3 + 1, 0}, {0, 0, 768 * 3 + 1}}).touches(o, e));
    // The largest triangle and page that there may be.
    const int far = kMaxEdgeSteps;
    const glm::i32vec3 corner(-far / 2, -far / 2, -far / 2);
    EXPECT_TRUE(CubeTest({corner, corner + glm::i32vec3(far, far, 0), corner + glm::i32vec3(far, 0, far)}).touches(glm::i32vec3(0), kLatticePerCell << 7));
}

/// A page with one level of cells or subcells, every leaf hard that a triangle touches.
class SoupPage {
public:
    SoupPage(uint32_t log2Cells, uint32_t depth) : depth_(depth) { header_.log2Cells = log2Cells; }

    uint32_t vertex(glm::i32vec3 p) {
        positions_.push_back(p);
        return static_cast<uint32_t>(positions_.size() - 1);
    }
    void triangle(uint32_t a, uint32_t b, uint32_t c) { triangles_.push_back({a, b, c}); }

    [[nodiscard]] WholePage build(uint32_t seed) {
        std::mt19937 random(seed);
        sums_.assign(positions_.size(), WideVector(0));
        for (const auto& t : triangles_)
            for (const uint32_t v : t) addNormal(sums_[v], areaNormal(positions_[t[0]], positions_[t[1]], positions_[t[2]]));
        std::vector<std::pair<glm::i32vec3, uint32_t>> queue;  // internal nodes, breadth first
        header_.root = node(glm::i32vec3(0), 0, queue);
        for (size_t i = 0; i < queue.size(); ++i)
            for (int o = 0; o < 8; ++o) {
                const int edge = edgeAt(queue[i].second + 1);
                nodes_.push_back(node(queue[i].first + edge * glm::i32vec3(o & 1, o >> 1 & 1, o >> 2), queue[i].second + 1, queue));
            }
        header_.groups = static_cast<uint32_t>(nodes_.size() / 8);
        header_.triangles = static_cast<uint32_t>(records_.size());
        header_.vertices = static_cast<uint32_t>(numbers_.size());
        const PageSections s = pageSections(header_);
        WholePage page{Block(s.end / 16), {}};
        auto* out = reinterpret_cast<std::byte*>(page.geometry.data());
        std::memcpy(out, &header_, sizeof header_);
        if (!nodes_.empty()) std::memcpy(out + s.nodes, nodes_.data(), nodes_.size() * 4);
        if (!records_.empty()) std::memcpy(out + s.triangles, records_.data(), records_.size() * 8);
        auto* vertices = reinterpret_cast<glm::u32vec2*>(out + s.vertices);
        auto* normals = reinterpret_cast<uint32_t*>(out + s.normals);
        for (const auto& [v, number] : numbers_) {
            const glm::i32vec3 p = positions_[v] + kLatticeBias;
            vertices[number] = pack21(static_cast<uint32_t>(p.x), static_cast<uint32_t>(p.y), static_cast<uint32_t>(p.z));
            // As computed, near that, or any at all.
            NormalGridPoint point = normalGridPoint(sums_[v]);
            if (random() % 4 == 0) point.u = static_cast<uint32_t>(random() % (kNormalSteps + 1));
            normals[number] = random() % 8 == 0 ? static_cast<uint32_t>(random()) : packGridNormal(point, random() % 5 == 0);
        }
        page.colour = randomColours(*parsePage(asBytes(page.geometry)), seed);
        return page;
    }

    bool forgetATriangle = false;  ///< in the first leaf that has two

private:
    [[nodiscard]] int edgeAt(uint32_t depth) const { return (kLatticePerCell << header_.log2Cells) >> depth; }

    uint32_t node(glm::i32vec3 lower, uint32_t depth, std::vector<std::pair<glm::i32vec3, uint32_t>>& queue) {
        std::vector<uint32_t> inside;
        for (uint32_t k = 0; k < triangles_.size(); ++k) {
            const std::array<glm::i32vec3, 3> t{positions_[triangles_[k][0]], positions_[triangles_[k][1]], positions_[triangles_[k][2]]};
            bool boxes = true;
            for (int axis = 0; axis < 3; ++axis)
                boxes = boxes && std::min({t[0][axis], t[1][axis], t[2][axis]}) <= lower[axis] + edgeAt(depth) && std::max({t[0][axis], t[1][axis], t[2][axis]}) >= lower[axis];
            if (boxes && CubeTest(t).touches(lower, edgeAt(depth))) inside.push_back(k);
        }
        if (inside.empty()) return emptyNode(0.25 * double(depth));
        if (depth < depth_) {
            queue.emplace_back(lower, depth);
            return kNodeInternal << kNodeTypeShift | static_cast<uint32_t>(queue.size() - 1);
        }
        ++header_.hardLeaves;
        if (forgetATriangle && inside.size() > 1) {
            inside.pop_back();
            forgetATriangle = false;
        }
        const uint32_t first = static_cast<uint32_t>(records_.size()), count = static_cast<uint32_t>(inside.size());
        if (count >= kHardCountLong) records_.emplace_back(count, 0u);
        for (const uint32_t k : inside) {
            uint32_t v[3];
            for (size_t i = 0; i < 3; ++i) v[i] = numbers_.try_emplace(triangles_[k][i], static_cast<uint32_t>(numbers_.size())).first->second;
            records_.push_back(pack21(v[0], v[1], v[2]));
        }
        return kNodeHard << kNodeTypeShift | std::min(count, kHardCountLong) << kHardCountShift | first;
    }

    PageHeader header_;
    uint32_t depth_;
    std::vector<glm::i32vec3> positions_;
    std::vector<std::array<uint32_t, 3>> triangles_;
    std::vector<WideVector> sums_;
    std::vector<uint32_t> nodes_;
    std::vector<glm::u32vec2> records_;
    std::map<uint32_t, uint32_t> numbers_;  ///< of vertices in the page
};

glm::i32vec3 randomPoint(std::mt19937& random, int edge) {
    const auto any = [&] { return static_cast<int>(random() % static_cast<unsigned>(edge)); };
    return {any(), any(), any()};
}

/// Triangles anywhere, many of which share vertices: borders, fans, edges of three and more.
SoupPage soup(uint32_t seed, uint32_t log2Cells, uint32_t depth, uint32_t vertices, uint32_t triangles) {
    std::mt19937 random(seed);
    SoupPage page(log2Cells, depth);
    const int edge = kLatticePerCell << log2Cells;
    for (uint32_t i = 0; i < vertices; ++i) page.vertex(randomPoint(random, edge + edge / 4) - edge / 8);
    std::set<std::array<uint32_t, 3>> made;
    while (made.size() < triangles) {
        std::array<uint32_t, 3> v;
        for (uint32_t& at : v) at = static_cast<uint32_t>(random() % vertices);
        std::array<uint32_t, 3> sorted = v;
        std::sort(sorted.begin(), sorted.end());
        if (sorted[0] == sorted[1] || sorted[1] == sorted[2] || !made.insert(sorted).second) continue;
        page.triangle(v[0], v[1], v[2]);
    }
    return page;
}

/// A bumpy sheet of n x n squares with holes, in both windings.
SoupPage sheet(uint32_t seed, uint32_t log2Cells, uint32_t depth, uint32_t n) {
    std::mt19937 random(seed);
    SoupPage page(log2Cells, depth);
    const int edge = kLatticePerCell << log2Cells;
    for (uint32_t y = 0; y <= n; ++y)
        for (uint32_t x = 0; x <= n; ++x)
            page.vertex({static_cast<int>(x) * edge / static_cast<int>(n), static_cast<int>(y) * edge / static_cast<int>(n), edge / 2 + static_cast<int>(random() % 300)});
    for (uint32_t y = 0; y < n; ++y)
        for (uint32_t x = 0; x < n; ++x) {
            const uint32_t a = x + (n + 1) * y, b = a + 1, c = a + n + 1, d = c + 1;
            if (random() % 9 != 0) page.triangle(a, b, c);
            if (random() % 9 != 0) random() % 2 == 0 ? page.triangle(b, d, c) : page.triangle(c, d, b);
        }
    return page;
}

TEST(PageCodec, SoftPagesComeBack) {
    for (uint32_t log2Cells = 1; log2Cells <= 5; ++log2Cells)
        for (uint32_t axis = 0; axis < 3; ++axis) {
            SCOPED_TRACE(log2Cells * 10 + axis);
            const double n = std::exp2(log2Cells);
            for (const auto& field : {test::sphere(glm::dvec3(n * 0.45), n * 0.4), test::plane(glm::normalize(glm::dvec3(1, 2, 3)), n), test::torus(glm::dvec3(n * 0.5), n * 0.3, n * 0.11)}) {
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
        expectRoundTrip(soup(seed, log2Cells, std::min(depth, 4u), 8 + static_cast<uint32_t>(random() % 30), 1 + static_cast<uint32_t>(random() % 40)).build(seed), kCoded);
    }
}

TEST(PageCodec, SheetsComeBack) {
    for (uint32_t seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE(seed);
        expectRoundTrip(sheet(seed, 2, 2 + seed % 2, 4 + seed).build(seed), kCoded);
    }
}

TEST(PageCodec, LongLeavesComeBack) {
    // One leaf with 254, 255 and 300 triangles: both forms of the count.
    for (const uint32_t count : {254u, 255u, 300u}) {
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
    const PackedPage a = packPage(asBytes(soft.geometry), {}), b = packPage(asBytes(hard.geometry), asBytes(hard.colour));
    EXPECT_EQ(hashBytes(a.geometry), 10564386174724560174u);
    EXPECT_EQ(hashBytes(b.geometry), 1920278069947240605u);
    EXPECT_EQ(hashBytes(b.colour), 2651053299021788687u);
}

/// Decodes hostile bytes: refused, or of the size that was asked for.
bool decodes(std::span<const std::byte> bytes, const WholePage& like) {
    const auto geometry = unpackGeometry(bytes, like.geometry.size() * 16);
    if (!geometry.ok()) {
        EXPECT_FALSE(geometry.error().message.empty());
        return false;
    }
    EXPECT_EQ(geometry->size(), like.geometry.size());
    (void)parsePage(asBytes(*geometry));
    return true;
}

TEST(PageCodec, EveryTruncationIsRefused) {
    const WholePage page = sheet(2, 2, 3, 8).build(2);
    const PackedPage packed = packPage(asBytes(page.geometry), asBytes(page.colour));
    for (size_t size = 0; size < packed.geometry.size(); ++size) {
        // A copy of its own, so that a read behind the end is seen.
        const std::vector<std::byte> part(packed.geometry.begin(), packed.geometry.begin() + static_cast<std::ptrdiff_t>(size));
        // The last bytes may be rounding that a decoder does not need.
        const bool decoded = decodes(part, page);
        EXPECT_TRUE(!decoded || size + 4 >= packed.geometry.size()) << size;
    }
    std::vector<std::byte> longer = packed.geometry;
    longer.resize(longer.size() + 16, std::byte{1});
    EXPECT_FALSE(decodes(longer, page));
    // Sizes that are no page's, for both forms.
    for (const std::byte form : {kPlain, kCoded})
        for (const uint64_t bytes : {0u, 1u, 8u, 63u, 72u, 1000u}) {
            std::vector<std::byte> other = packed.geometry;
            other[0] = form;
            EXPECT_FALSE(unpackGeometry(other, bytes).ok()) << bytes;
        }
    EXPECT_FALSE(unpackGeometry(packed.geometry, page.geometry.size() * 16 + 16).ok());
    EXPECT_FALSE(unpackColour(packed.colour, page.colour.size() * 16 + 16, page.view()).ok());
    EXPECT_FALSE(unpackColour({}, page.colour.size() * 16, page.view()).ok());
}

TEST(PageCodec, HostileBytesAreHarmless) {
    for (const WholePage& page : {sheet(3, 2, 3, 8).build(3), soup(4, 2, 4, 20, 25).build(4), analyticPage(test::sphere({4, 4, 4}, 3), 3, 0)}) {
        const PackedPage packed = packPage(asBytes(page.geometry), asBytes(page.colour));
        std::mt19937 random(11);
        for (int i = 0; i < 3000; ++i) {
            std::vector<std::byte> bytes = packed.geometry;
            // Mostly behind the counts, which lie in the first bytes of either stream.
            for (auto k = 1 + random() % 3; k > 0; --k) bytes[1 + random() % (bytes.size() - 1)] ^= static_cast<std::byte>(1u << random() % 8);
            decodes(bytes, page);
            if (page.colour.empty()) continue;
            std::vector<std::byte> colour = packed.colour;
            colour[1 + random() % (colour.size() - 1)] ^= static_cast<std::byte>(1u << random() % 8);
            const auto decoded = unpackColour(colour, page.colour.size() * 16, *parsePage(asBytes(*unpackGeometry(packed.geometry, page.geometry.size() * 16))));
            EXPECT_TRUE(!decoded.ok() || decoded->size() == page.colour.size());
        }
        for (int i = 0; i < 3000; ++i) {
            std::vector<std::byte> bytes(random() % 400);
            for (std::byte& b : bytes) b = static_cast<std::byte>(random());
            if (!bytes.empty()) bytes[0] = kCoded;
            decodes(bytes, page);
        }
    }
}

TEST(VertexNormal, GridPointsComeBackAndAreNear) {
    std::mt19937 random(9);
    for (int i = 0; i < 20000; ++i) {
        SCOPED_TRACE(i);
        const int bits = 1 + i % 40;
        const auto any = [&] { return static_cast<int64_t>(random() | uint64_t{random()} << 32) >> (63 - bits); };
        const WideVector sum(any(), any(), any());
        if (sum == WideVector(0)) continue;
        const bool crease = i % 2 != 0;
        const NormalGridPoint point = normalGridPoint(sum), turned = normalGridPoint(-sum);
        const uint32_t code = packGridNormal(point, crease);
        NormalGridPoint back{};
        ASSERT_TRUE(gridPointOf(code, back));
        ASSERT_EQ(back.u, point.u);
        ASSERT_EQ(back.v, point.v);
        ASSERT_EQ(turned.u, point.u) << "a normal has no side";
        ASSERT_EQ(turned.v, point.v);
        ASSERT_EQ((code & kNormalCreaseBit) != 0, crease);
        const glm::dvec3 n = glm::normalize(glm::dvec3(sum)), m = f64::decodeNormal(code);
        ASSERT_LT(glm::length(glm::cross(n, m)), 0.00122) << "0.07 degrees";
    }
}

TEST(VertexNormal, CreasesTurnByFortyDegrees) {
    for (const int degrees : {0, 10, 38, 42, 80, 138, 142, 180}) {
        const double a = degrees * 3.14159265358979 / 180;
        const WideVector sum(0, 0, 1 << 20);
        const WideVector normal(static_cast<int64_t>(std::sin(a) * 1e6), 0, static_cast<int64_t>(std::cos(a) * 1e6));
        const std::vector<std::array<uint32_t, 3>> triangles{{0, 0, 0}};
        EXPECT_EQ(creases(std::span(&normal, 1), std::span(&sum, 1), triangles)[0] != 0, degrees > 40 && degrees < 140) << degrees;
    }
}

}  // namespace
}  // namespace vcp
