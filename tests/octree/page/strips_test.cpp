// Strips of any list of triangles read back as the same triangles, each with its front; they are short where neighbours
// agree in their fronts, and broken ones lead nowhere.
#include "octree/page/strips.h"

#include <algorithm>
#include <cstddef>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

using Triangles = std::vector<Index3>;

/// The triangles in an order of their own, each with its smallest vertex first: what must not change.
Triangles inOrder(Triangles triangles) {
    for (Index3& t : triangles) {
        Index3 least = t;
        for (size_t i = 0; i < 2; ++i) {
            std::rotate(t.begin(), t.begin() + 1, t.end());
            least = std::min(least, t);
        }
        t = least;
    }
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

/// Entries as a page with so many vertices keeps them.
struct Stored {
    std::vector<std::byte> bytes;
    StripEntries entries;

    Stored(std::span<const uint32_t> from, uint32_t vertices) : bytes(from.size() * entryBytes(vertices)) {
        storeEntries(from, vertices, bytes.data());
        entries = StripEntries(bytes, entryBytes(vertices));
    }
};

Triangles trianglesOf(const StripEntries& entries, uint32_t leaf) {
    Triangles triangles;
    forEachTriangle(entries, leaf, [&](const Index3& t) { triangles.push_back(t); });
    return triangles;
}

/// Checks that a leaf comes back, behind other entries and from both sizes of entries. Returns how many it took.
size_t expectBack(const Triangles& triangles) {
    std::vector<uint32_t> entries(5, 0xffffffffu);
    const uint32_t leaf = appendHardLeaf(triangles, entries);
    EXPECT_EQ(leaf >> kNodeTypeShift, kNodeHard);
    EXPECT_EQ(leaf & kHardFirstMask, 5u);
    for (const uint32_t vertices : {kShortEntryVertices, kShortEntryVertices + 1}) {
        const Stored stored(entries, vertices);
        StripWalk walk(stored.entries, leaf);
        EXPECT_EQ(walk.count(), triangles.size());
        while (walk.next()) {
        }
        EXPECT_TRUE(walk.isWhole());
        EXPECT_EQ(walk.entry() + 1, entries.size());
        EXPECT_EQ(inOrder(trianglesOf(stored.entries, leaf)), inOrder(triangles));
    }
    std::vector<uint32_t> again(5, 0xffffffffu);
    EXPECT_EQ(appendHardLeaf(triangles, again), leaf);
    EXPECT_EQ(again, entries);
    const bool isLong = triangles.size() >= kHardCountLong;
    EXPECT_LE(entries.size() - 5, 3 * triangles.size() + (isLong ? 2 : 0));
    return entries.size() - 5;
}

/// Triangles around vertex 0; a closed fan goes once around it.
Triangles fan(uint32_t count, bool closed) {
    Triangles triangles;
    for (uint32_t i = 0; i < count; ++i) triangles.push_back({0, 1 + i, closed ? 1 + (i + 1) % count : 2 + i});
    return triangles;
}

/// A sheet of n x n squares.
Triangles sheet(uint32_t n) {
    Triangles triangles;
    for (uint32_t y = 0; y < n; ++y)
        for (uint32_t x = 0; x < n; ++x) {
            const uint32_t a = x + (n + 1) * y, b = a + 1, c = a + n + 1, d = c + 1;
            triangles.push_back({a, b, c});
            triangles.push_back({b, d, c});
        }
    return triangles;
}

Triangles shuffled(Triangles triangles, uint32_t seed) {
    std::mt19937 random(seed);
    for (size_t i = triangles.size(); i > 1; --i) std::swap(triangles[i - 1], triangles[random() % i]);
    for (Index3& t : triangles) std::rotate(t.begin(), t.begin() + std::ptrdiff_t(random() % 3), t.end());
    return triangles;
}

TEST(Strips, OneTriangle) { EXPECT_EQ(expectBack({{7, 3, 5}}), 3u); }

TEST(Strips, StepsLeadOverEachEdge) {
    // Each triangle runs along its edge with the one before in the other direction.
    const std::vector<uint32_t> entries = {10, 11, 12, stripEntry(3, 1), stripEntry(1, 2), stripEntry(2, 3), 7, 8, 9};
    const Stored stored(entries, 4);
    EXPECT_EQ(trianglesOf(stored.entries, kNodeHard << kNodeTypeShift | 5u << kHardCountShift),
              (Triangles{{10, 11, 12}, {10, 1, 11}, {2, 11, 1}, {2, 1, 3}, {7, 8, 9}}));
}

TEST(Strips, RandomSoupsComeBack) {
    // From all vertices alike to hardly any shared: triangles twice, back to back, and with a vertex twice or thrice.
    for (uint32_t seed = 0; seed < 400; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const uint32_t vertices = 1 + uint32_t(random() % (seed % 2 == 0 ? 12 : 4000));
        Triangles triangles(1 + random() % (seed % 7 == 0 ? 300 : 20));
        for (Index3& t : triangles)
            for (uint32_t& v : t) v = uint32_t(random() % vertices);
        expectBack(triangles);
    }
}

TEST(Strips, FansAreOneStrip) {
    for (const uint32_t count : {3u, 9u, 16u, 62u})
        for (const bool closed : {false, true})
            EXPECT_EQ(expectBack(shuffled(fan(count, closed), count)), count + 2) << count;
}

TEST(Strips, SheetsAreFewStrips) {
    // No path leads through all eight triangles.
    EXPECT_EQ(expectBack(sheet(2)), 12u);
    size_t entries = 0;
    for (uint32_t seed = 0; seed < 20; ++seed) entries += expectBack(shuffled(sheet(3), seed));
    EXPECT_LE(entries, 20u * 24) << "18 triangles in three strips";
}

TEST(Strips, ClosedMeshesComeBack) {
    EXPECT_EQ(expectBack({{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}), 6u);
    Triangles octahedron;
    for (uint32_t i = 0; i < 4; ++i) {
        octahedron.push_back({4, i, (i + 1) % 4});
        octahedron.push_back({5, (i + 1) % 4, i});
    }
    EXPECT_EQ(expectBack(octahedron), 10u);
}

TEST(Strips, FrontsAreKeptWhereNeighboursDisagree) {
    // The second triangle is turned over: no step leads to it.
    EXPECT_EQ(expectBack({{0, 1, 2}, {1, 2, 3}}), 6u);
    EXPECT_EQ(expectBack({{0, 1, 2}, {2, 1, 3}}), 4u);
    // A triangle and its back share three edges.
    EXPECT_EQ(expectBack({{0, 1, 2}, {2, 1, 0}}), 4u);
}

TEST(Strips, EdgesOfManyTriangles) {
    // A book: pages around the edge of 0 and 1, every second one turned over.
    for (const uint32_t pages : {3u, 4u, 40u, 200u}) {
        Triangles book;
        for (uint32_t i = 0; i < pages; ++i) book.push_back(i % 2 == 0 ? Index3{0, 1, 2 + i} : Index3{1, 0, 2 + i});
        expectBack(book);
    }
}

TEST(Strips, RepeatedVertices) {
    expectBack({{1, 1, 1}});
    expectBack({{1, 1, 2}, {1, 2, 1}, {2, 1, 1}});
    expectBack({{1, 1, 2}, {2, 1, 3}, {1, 1, 1}, {1, 2, 3}, {1, 2, 3}});
}

TEST(Strips, LongLeavesComeBack) {
    for (const uint32_t count : {kHardCountLong - 1, kHardCountLong, 64u, 65u, 127u, 128u, 129u}) {
        Triangles triangles = sheet(9);
        triangles.resize(count);
        expectBack(triangles);
    }
    // 20000 triangles around one edge cost no more each than few; two entries say how many they are.
    Triangles book;
    for (uint32_t i = 0; i < 20000; ++i) book.push_back({0, 1, 2 + i % 5000});
    EXPECT_EQ(expectBack(book), 60002u);
    // A sheet keeps most of its strips.
    const Triangles large = sheet(60);
    EXPECT_LT(expectBack(large), large.size() * 5 / 4);
}

TEST(Strips, BrokenEntriesEndTheWalk) {
    const auto walked = [](const std::vector<uint32_t>& entries, uint32_t first, uint32_t count) {
        const Stored stored(entries, 4);
        StripWalk walk(stored.entries, kNodeHard << kNodeTypeShift | count << kHardCountShift | first);
        uint32_t triangles = 0;
        while (walk.next()) ++triangles;
        EXPECT_EQ(walk.isWhole(), triangles == walk.count());
        return triangles;
    };
    const std::vector<uint32_t> good = {0, 1, 2, stripEntry(1, 3)};
    EXPECT_EQ(walked(good, 0, 2), 2u);
    EXPECT_EQ(walked(good, 0, 3), 2u) << "no entries are left";
    EXPECT_EQ(walked(good, 3, 1), 0u) << "no triangle leads there";
    EXPECT_EQ(walked(good, 1, 1), 0u) << "it begins with two vertices only";
    EXPECT_EQ(walked(good, 2, 1), 0u);
    EXPECT_EQ(walked(good, 4, 1), 0u);
    EXPECT_EQ(walked(good, kHardFirstMask, 1), 0u);
    EXPECT_EQ(walked(good, 3, kHardCountLong), 0u) << "the number of triangles is cut off";
    EXPECT_EQ(walked({}, 0, kHardCountLong), 0u);
}

}  // namespace
}  // namespace vcp
