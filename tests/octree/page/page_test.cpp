// parsePage: what it accepts can be walked without leaving the page, and hostile pages are refused. Pages written
// by the builder are parsed in tests/builder/page/page_builder_test.cpp.
#include "octree/page/page.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <random>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "octree/surface/packing.h"
#include "tests/support/analytic_page.h"

namespace vcp {
namespace {

constexpr uint32_t word(uint32_t type, uint32_t payload) { return type << kNodeTypeShift | payload; }
constexpr uint32_t softLeaf(uint32_t face, uint32_t axis) { return word(kNodeSoft, axis << kSoftAxisShift | face); }
constexpr uint32_t hardLeaf(uint32_t first, uint32_t count) {
    return word(kNodeHard, count << kHardCountShift | first);
}

/// The parts of a page, from which its bytes are laid out whatever they claim.
struct PageParts {
    PageHeader header;
    std::vector<uint32_t> nodes;
    std::vector<uint4> faces;
    std::vector<glm::u32vec2> vertices;
    std::vector<uint32_t> normals, entries;

    /// Fills the header's counts.
    void count() {
        header.groups = uint32_t(nodes.size() / 8);
        header.faces = uint32_t(faces.size());
        header.entries = uint32_t(entries.size());
        header.vertices = uint32_t(vertices.size());
    }

    /// In a block of exactly their size, so that sanitizers see a read behind it.
    [[nodiscard]] std::vector<uint4> bytes() const {
        PageHeader sized = header;
        sized.groups = uint32_t(nodes.size() / 8);
        sized.faces = uint32_t(faces.size());
        sized.entries = uint32_t(entries.size());
        sized.vertices = uint32_t(vertices.size());
        const PageSections s = pageSections(sized);
        std::vector<uint4> out(s.end / 16);
        auto* at = reinterpret_cast<std::byte*>(out.data());
        const auto copy = [&](uint64_t offset, const auto& items) {
            if (!items.empty()) std::memcpy(at + offset, items.data(), items.size() * sizeof(items[0]));
        };
        std::memcpy(at, &header, sizeof header);
        copy(s.nodes, nodes);
        copy(s.faces, faces);
        copy(s.vertices, vertices);
        copy(s.normals, normals);
        storeEntries(entries, sized.vertices, at + s.strips);
        return out;
    }
};

/// A page with every kind of node: two groups, two soft leaves that share a face, a slab leaf, a hard leaf, a long one.
PageParts smallPage() {
    PageParts p;
    p.header.log2Cells = 1;
    p.header.root = word(kNodeInternal, 0);
    p.header.softLeaves = 2;
    p.header.hardLeaves = 2;
    p.header.slabLeaves = 1;
    p.header.certifiedError = 0.05f;
    p.nodes = {word(kNodeInternal, 1), softLeaf(0, 0),     softLeaf(1, 0), hardLeaf(0, 2),
               emptyNode(0),           slabNode(0xa5, 12), emptyNode(1),   emptyNode(0)};
    p.nodes.resize(15, emptyNode(0));
    p.nodes.push_back(hardLeaf(4, kHardCountLong));
    for (uint32_t i = 0; i < 3; ++i)
        p.faces.emplace_back(packVector(0.3 + 0.1 * i, {0, 0, 1}, false), packVector(0.2, {0, 1, 0}, true),
                             packVector(0.7, {1, 0, 0}, false), packVector(0.1, {0, 0, -1}, true));
    p.faces.emplace_back(packSlab(packSlabDirection({0, 0.6, 0.8}), 0.1, 0.2), 0, 0, 0);
    // (0, 1, 2), (0, 2, 3); three triangles: (0, 1, 3), (2, 3, 1), (2, 0, 3).
    p.entries = {0, 1, 2, stripEntry(2, 3)};
    p.entries.insert(p.entries.end(), {3, 0, 0, 1, 3, stripEntry(1, 2), stripEntry(2, 0)});
    for (uint32_t i = 0; i < 4; ++i) {
        const uint32_t far = kLatticeBias + 900;
        p.vertices.push_back(
            pack21(i == 1 ? far : kLatticeBias, i == 2 ? far : kLatticeBias, i == 3 ? far : kLatticeBias));
        p.normals.push_back(packNormal({0, 0, 1}, i == 2));
    }
    p.count();
    return p;
}

/// Walks all that a traversal may touch. Returns the number of nodes; a page that parsePage took has at most
/// one more than 8 * groups, and a longer walk is a loop.
class PageWalk {
public:
    explicit PageWalk(const PageView& page) : page_(page) {}

    uint64_t run() {
        visit(page_.header.root, 0);
        return nodes_;
    }
    uint64_t sum = 0;  ///< of all that was read, so that no read is optimized away

private:
    void visit(uint32_t node, uint32_t depth) {
        ++nodes_;
        ASSERT_LE(nodes_, uint64_t{8} * page_.header.groups + 1);
        ASSERT_LE(depth, page_.header.log2Cells + kMaxSubcellDepth);
        const uint32_t index = node & kLeafIndexMask;
        switch (nodeType(node)) {
            case kNodeInternal:
                for (uint32_t i = 0; i < 8; ++i)
                    visit(page_.nodes[8 * uint64_t{node & kNodePayloadMask} + i], depth + 1);
                return;
            case kNodeSoft: {
                const uint32_t axis = node >> kSoftAxisShift & 3u;
                ASSERT_LE(axis, 2u);
                for (uint32_t c = 0; c < 4; ++c) sum += page_.faces[index][c] + page_.faces[index + 1][c];
                return;
            }
            case kNodeHard: {
                uint32_t triangles = 0;
                forEachTriangle(page_.strips, node, [&](const Index3& triangle) {
                    ++triangles;
                    for (const uint32_t v : triangle)
                        sum += page_.vertices[v].x + page_.vertices[v].y + page_.normals[v];
                });
                ASSERT_GT(triangles, 0u);
                ASSERT_EQ(triangles, StripWalk(page_.strips, node).count());
                return;
            }
            case kNodeSlab: {
                ASSERT_NE(slabOctants(node), 0u);
                sum += vectorWord(page_.faces, slabVector(node));
                return;
            }
            default:
                sum += uint64_t(nodeClearance(node));
        }
    }

    const PageView& page_;
    uint64_t nodes_ = 0;
};

std::span<const std::byte> bytesOfBlock(const std::vector<uint4>& block) { return std::as_bytes(std::span(block)); }

/// Parses; what is accepted is walked. True when accepted.
bool parseAndWalk(const std::vector<uint4>& block) {
    const auto page = parsePage(bytesOfBlock(block));
    if (!page) {
        EXPECT_EQ(page.error().code, ErrorCode::InvalidInput);
        EXPECT_FALSE(page.error().message.empty());
        EXPECT_TRUE(page.error().byte.has_value());
        return false;
    }
    EXPECT_GE(PageWalk(*page).run(), 1u);
    return true;
}

void expectRefused(const PageParts& parts, const std::string& words) {
    const std::vector<uint4> block = parts.bytes();
    const auto page = parsePage(bytesOfBlock(block));
    ASSERT_FALSE(page.ok()) << "accepted, but should say: " << words;
    EXPECT_NE(page.error().line().find(words), std::string::npos) << page.error().line();
}

std::vector<Index3> trianglesOfNode(const PageView& page, size_t node) {
    std::vector<Index3> triangles;
    forEachTriangle(page.strips, page.nodes[node], [&](const Index3& triangle) { triangles.push_back(triangle); });
    return triangles;
}

TEST(Page, EveryKindOfNodeIsRead) {
    const std::vector<uint4> block = smallPage().bytes();
    const auto page = parsePage(bytesOfBlock(block));
    ASSERT_TRUE(page.ok()) << page.error().line();
    EXPECT_EQ(PageWalk(*page).run(), 17u);
    EXPECT_EQ(page->nodes.size(), 16u);
    EXPECT_EQ(page->faces.size(), 4u);
    EXPECT_EQ(page->vertices.size(), 4u);
    EXPECT_EQ(trianglesOfNode(*page, 3), (std::vector<Index3>{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_EQ(trianglesOfNode(*page, 15), (std::vector<Index3>{{0, 1, 3}, {2, 3, 1}, {2, 0, 3}}));
}

TEST(Page, EntriesAreLongWhereVerticesAreMany) {
    for (const uint32_t vertices : {kShortEntryVertices, kShortEntryVertices + 1}) {
        PageParts p = smallPage();
        p.vertices.resize(vertices, p.vertices[0]);
        p.normals.resize(vertices, p.normals[0]);
        p.entries[3] = stripEntry(2, vertices - 1);
        p.count();
        const std::vector<uint4> block = p.bytes();
        const auto page = parsePage(bytesOfBlock(block));
        ASSERT_TRUE(page.ok()) << page.error().line();
        EXPECT_EQ(trianglesOfNode(*page, 3), (std::vector<Index3>{{0, 1, 2}, {0, 2, vertices - 1}}));
        EXPECT_EQ(trianglesOfNode(*page, 15), (std::vector<Index3>{{0, 1, 3}, {2, 3, 1}, {2, 0, 3}}));
        const PageSections s = pageSections(page->header);
        EXPECT_EQ(s.end - s.strips, vertices == kShortEntryVertices ? 32u : 48u);
    }
}

TEST(Page, AnalyticPagesAreAccepted) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const auto field = test::sphere({8, 8, 8}, 6);
        const auto page = test::AnalyticPageBuilder(field, glm::dvec3(0), 1, 4, axis, 0.05f, 1).build();
        EXPECT_TRUE(parseAndWalk(page.bytes.geometry)) << axis;
    }
}

TEST(Page, RootMayBeALeaf) {
    PageParts empty;
    empty.header.log2Cells = 5;
    empty.header.root = emptyNode(32);
    EXPECT_TRUE(parseAndWalk(empty.bytes()));

    PageParts hard = smallPage();
    hard.nodes.clear();
    hard.header.root = hardLeaf(0, 2);
    hard.header.softLeaves = 0;
    hard.header.hardLeaves = 1;
    hard.header.slabLeaves = 0;
    hard.count();
    EXPECT_TRUE(parseAndWalk(hard.bytes()));
}

TEST(Page, EveryTruncationIsRefused) {
    const std::vector<uint4> block = smallPage().bytes();
    for (size_t size = 0; size < block.size() * 16; ++size) {
        // A copy of its own, so that a read behind the end is seen.
        std::vector<uint4> part((size + 15) / 16);
        if (size > 0) std::memcpy(part.data(), block.data(), size);
        EXPECT_FALSE(parsePage(bytesOfBlock(part).first(size)).ok()) << size;
    }
}

TEST(Page, OneBlockTooManyIsRefused) {
    std::vector<uint4> block = smallPage().bytes();
    block.emplace_back(0u);
    EXPECT_FALSE(parsePage(bytesOfBlock(block)).ok());
}

TEST(Page, NoBitFlipLeadsOutOfThePage) {
    const std::vector<uint4> block = smallPage().bytes();
    size_t refused = 0;
    for (size_t bit = 0; bit < block.size() * 128; ++bit) {
        SCOPED_TRACE(bit);
        std::vector<uint4> changed = block;
        reinterpret_cast<uint8_t*>(changed.data())[bit / 8] ^= uint8_t(1u << bit % 8);
        refused += !parseAndWalk(changed);
        if (HasFailure()) return;
    }
    // All of magic, sizes and counts (but for the error's low bits) and most of the node words.
    EXPECT_GT(refused, 400u);
}

TEST(Page, NoRandomDamageLeadsOutOfThePage) {
    const std::vector<uint4> block = smallPage().bytes();
    std::mt19937 random(7);
    for (int i = 0; i < 60000; ++i) {
        SCOPED_TRACE(i);
        std::vector<uint4> changed = block;
        auto* words = reinterpret_cast<uint32_t*>(changed.data());
        const uint32_t count = 1 + random() % 4;
        for (uint32_t k = 0; k < count; ++k) {
            // Mostly node words, mostly near what is valid: else nothing but the first check is reached.
            const size_t at = random() % 4 == 0 ? random() % (block.size() * 4) : 16 + random() % 16;
            const auto any = [&](uint32_t below) { return uint32_t(random() % below); };
            words[at] = any(2) == 0 ? word(any(4), any(8) | any(3) << kHardCountShift) : uint32_t(random());
        }
        parseAndWalk(changed);
        if (HasFailure()) return;
    }
}

TEST(Page, GroupsFormATree) {
    PageParts self = smallPage();
    self.nodes[8] = word(kNodeInternal, 1);
    expectRefused(self, "wrong group");

    PageParts up = smallPage();
    up.nodes[8] = word(kNodeInternal, 0);
    expectRefused(up, "wrong group");

    PageParts shared = smallPage();
    shared.nodes[4] = word(kNodeInternal, 1);
    expectRefused(shared, "wrong group");

    PageParts outside = smallPage();
    outside.nodes[8] = word(kNodeInternal, 2);
    expectRefused(outside, "wrong group");
    outside.nodes[8] = word(kNodeInternal, kNodePayloadMask);
    expectRefused(outside, "wrong group");

    PageParts orphan = smallPage();
    orphan.nodes.resize(24, emptyNode(0));
    orphan.count();
    expectRefused(orphan, "without a parent");
}

TEST(Page, NestingIsBounded) {
    for (const uint32_t log2Cells : {1u, 5u, 7u})
        for (const uint32_t extra : {0u, 1u}) {
            PageParts p;
            p.header.log2Cells = log2Cells;
            p.header.root = word(kNodeInternal, 0);
            const uint32_t depth = log2Cells + kMaxSubcellDepth + extra;
            for (uint32_t g = 0; g < depth; ++g) {
                p.nodes.push_back(g + 1 < depth ? word(kNodeInternal, g + 1) : emptyNode(0));
                p.nodes.resize(p.nodes.size() + 7, emptyNode(0));
            }
            p.count();
            if (extra == 0)
                EXPECT_TRUE(parseAndWalk(p.bytes())) << log2Cells;
            else
                expectRefused(p, "nested too deeply");
        }
}

TEST(Page, LyingCountsAreRefused) {
    for (const uint32_t lie : {5u, 1u << 22, 1u << 27, 1u << 28, 1u << 29, 0x80000000u, 0xffffffffu})
        for (uint32_t PageHeader::*const field :
             {&PageHeader::groups, &PageHeader::faces, &PageHeader::entries, &PageHeader::vertices}) {
            PageParts p = smallPage();
            p.header.*field = lie;
            const std::vector<uint4> block = p.bytes();
            EXPECT_FALSE(parsePage(bytesOfBlock(block)).ok()) << lie;
        }
    PageParts soft = smallPage();
    ++soft.header.softLeaves;
    expectRefused(soft, "leaf counts");
    PageParts hard = smallPage();
    --hard.header.hardLeaves;
    expectRefused(hard, "leaf counts");
    for (const uint32_t lie : {2u, 16u}) {
        PageParts slab = smallPage();
        slab.header.slabLeaves = lie;
        expectRefused(slab, "leaf counts");
    }
    for (const uint32_t lie : {17u, 0xffffffffu}) {
        PageParts slab = smallPage();
        slab.header.slabLeaves = lie;
        expectRefused(slab, "byte 40: fewer vectors than slab leaves");
    }
}

TEST(Page, HeaderValuesAreChecked) {
    PageParts magic = smallPage();
    magic.header.magic = 0;
    expectRefused(magic, "not a page");
    for (const uint32_t log2Cells : {0u, 8u, 31u, 0xffffffffu}) {
        PageParts p = smallPage();
        p.header.log2Cells = log2Cells;
        expectRefused(p, "page size");
    }
    for (const float error : {-1.0f, std::numeric_limits<float>::quiet_NaN()}) {
        PageParts p = smallPage();
        p.header.certifiedError = error;
        expectRefused(p, "certified error");
    }
    PageParts reserved = smallPage();
    reserved.header.reserved[4] = 1;
    expectRefused(reserved, "byte 60: reserved");
}

TEST(Page, LeavesStayInTheirSections) {
    PageParts lastFace = smallPage();
    lastFace.nodes[1] = softLeaf(3, 0);  // its second face would be the fifth
    expectRefused(lastFace, "soft leaf out of range");
    lastFace.nodes[1] = softLeaf(kLeafIndexMask, 0);
    expectRefused(lastFace, "soft leaf out of range");

    PageParts axis = smallPage();
    axis.nodes[1] = softLeaf(0, 3);
    expectRefused(axis, "soft leaf out of range");

    PageParts hard = smallPage();
    hard.nodes[3] = hardLeaf(11, 1);
    expectRefused(hard, "hard leaf out of range");
    hard.nodes[3] = hardLeaf(kHardFirstMask, 1);
    expectRefused(hard, "hard leaf out of range");
    hard.nodes[3] = hardLeaf(10, 2);
    expectRefused(hard, "too many triangles");
    hard.nodes[3] = hardLeaf(0, 0);
    expectRefused(hard, "too many triangles");

    // Triangles in the middle of a strip, at its begin and at its end.
    for (const uint32_t entry : {0u, 1u, 2u, 3u})
        for (const uint32_t vertex : {4u, (1u << kShortVertexBits) - 1}) {
            PageParts p = smallPage();
            p.entries[entry] = stripEntry(stepOf(p.entries[entry]), vertex);
            expectRefused(p, fmt::format("byte {}: triangle names a missing vertex",
                                         pageSections(p.header).strips + 2 * std::max(entry, 2u)));
        }
}

TEST(Page, SlabLeavesHaveVectorsOfTheirOwn) {
    PageParts p = smallPage();
    p.nodes[5] = slabNode(1, 15);
    EXPECT_TRUE(parseAndWalk(p.bytes()));
    p.nodes[5] = slabNode(1, 16);
    expectRefused(p, "byte 84: slab leaf out of range");
    p.nodes[5] = slabNode(1, kSlabVectorMask);
    expectRefused(p, "byte 84: slab leaf out of range");
    p.nodes[5] = slabNode(0, 12);
    expectRefused(p, "byte 84: slab leaf has no octants");

    PageParts shared = smallPage();
    shared.nodes[6] = slabNode(3, 12);
    shared.header.slabLeaves = 2;
    expectRefused(shared, "byte 88: slab leaf has another's vector");
    shared.nodes[6] = slabNode(3, 13);
    EXPECT_TRUE(parseAndWalk(shared.bytes()));

    // A page that is said to have none.
    PageParts none = smallPage();
    none.header.slabLeaves = 0;
    expectRefused(none, "byte 84: slab leaf out of range");
}

TEST(Page, StripsBegin) {
    PageParts middle = smallPage();
    middle.nodes[3] = hardLeaf(3, 1);
    expectRefused(middle, "byte 76: strips of a hard leaf are broken");
    for (const uint32_t entry : {0u, 1u, 2u})
        for (const uint32_t step : {1u, 2u, 3u}) {
            PageParts p = smallPage();
            p.entries[entry] = stripEntry(step, p.entries[entry]);
            expectRefused(p, "byte 76: strips of a hard leaf are broken");
        }
    PageParts last = smallPage();
    last.entries[9] = 2;  // begins, but the page ends with the second vertex
    expectRefused(last, "strips of a hard leaf are broken");
}

TEST(Page, LongHardLeavesCannotLie) {
    for (const uint32_t count : {0u, 8u, 0x3fffu, 0x4003u, 0xfffffffu, 0xffffffffu}) {
        PageParts p = smallPage();
        p.entries[4] = count & 0x3fffu;
        p.entries[5] = count >> kShortVertexBits;
        expectRefused(p, "too many triangles");
    }
    PageParts more = smallPage();
    more.entries[4] = 4;
    expectRefused(more, "strips of a hard leaf are broken");
    PageParts last = smallPage();
    last.nodes[15] = hardLeaf(10, kHardCountLong);  // the first entry with the count is the last
    last.entries[10] = 1;
    expectRefused(last, "too many triangles");
}

// Else a page of a few hundred kilobytes would ask for 10^11 checks here and 10^5 triangles in every leaf.
TEST(Page, LeavesDoNotShareEntries) {
    PageParts p = smallPage();
    p.nodes[4] = hardLeaf(0, 2);
    ++p.header.hardLeaves;
    expectRefused(p, "too many triangles");
}

TEST(Page, ColoursMatchTheirPage) {
    const PageParts parts = smallPage();
    const std::vector<uint4> block = parts.bytes();
    std::vector<uint4> colours(colourPageBytes(parts.header) / 16, uint4(1, 2, 3, 4));
    const auto page = parsePage(bytesOfBlock(block), bytesOfBlock(colours));
    ASSERT_TRUE(page.ok());
    EXPECT_EQ(page->faceColours.size(), 4u);
    EXPECT_EQ(page->vertexColours.size(), 4u);
    EXPECT_EQ(page->faceColours[2], uint4(1, 2, 3, 4));
    colours.emplace_back(0u);
    EXPECT_FALSE(parsePage(bytesOfBlock(block), bytesOfBlock(colours)).ok());
    colours.resize(1);
    EXPECT_FALSE(parsePage(bytesOfBlock(block), bytesOfBlock(colours)).ok());
}

TEST(Page, ClearanceIsRoundedDown) {
    for (const double cells : {0.0, 0.00390624, 0.5, 0.9999, 1.0, 31.999, 128.0}) {
        const uint32_t node = emptyNode(cells);
        EXPECT_EQ(nodeType(node), kNodeEmpty);
        EXPECT_LE(nodeClearance(node), cells);
        EXPECT_GT(nodeClearance(node), cells - 1 / 256.0 - 1e-12);
    }
}

}  // namespace
}  // namespace vcp
