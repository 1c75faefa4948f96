// Which parts of a mesh are closed: the same for any partition, and as a slow count says.
#include "builder/level/closed_parts.h"

#include <deque>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "tests/support/lattice_meshes.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

using Soup = std::vector<LatticeTriangle>;
using Point = std::array<int32_t, 3>;

constexpr PageGrid kGrid{3, 3};  // 64 cells an edge

Point pointOf(glm::i32vec3 p) { return {p.x, p.y, p.z}; }

PagePartition partitionOf(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<uint64_t> first{0};
    const uint64_t mean = 1 + random() % 40;
    for (uint64_t page = 1; page < uint64_t{1} << 3 * kGrid.level; ++page)
        if (random() % mean == 0) first.push_back(page);
    return PagePartition(first);
}

/// What is found of a soup: the counts, and the part of each vertex.
struct Found {
    PartCounts counts;
    std::map<Point, uint32_t> parts;
};

Found foundIn(const Soup& soup, const PagePartition& partition) {
    TestFolder folder("vcp_closed_parts_test");
    TempSpace space(folder.path() / "temp", uint64_t{1} << 30);
    // Bins come in any order, and note their parts in several places.
    std::deque<PartNotes> notes;
    std::vector<PartNotes*> all;
    for (size_t k = 0; k < 3; ++k) all.push_back(&notes.emplace_back(space, 1 << 20));
    Found found;
    std::map<Point, std::pair<uint32_t, size_t>> undecided;
    for (size_t bin = partition.bins(); bin-- > 0;) {
        const auto owns = [&](glm::i32vec3 p) { return partition.binOf(kGrid.pageOf(p)) == bin; };
        Soup own;
        for (const LatticeTriangle& t : soup)
            if (owns(t.corner[0]) || owns(t.corner[1]) || owns(t.corner[2])) own.push_back(t);
        const auto changed = keepCollapsed(
            own, owns, [](glm::i32vec3 p, glm::i32vec3 q) { return kGrid.pageOf(p) == kGrid.pageOf(q); },
            [](glm::i32vec3) { return 1; });
        LatticeMesh mesh = meshOf(own, false);
        EXPECT_TRUE(notes[bin % 3].add(mesh, changed, owns).ok());
        for (size_t v = 0; v < mesh.positions.size(); ++v)
            if (owns(mesh.positions[v]))
                undecided[pointOf(mesh.positions[v])] = {mesh.parts.empty() ? kClosedPart : mesh.parts[v], bin % 3};
    }
    const auto joined = PartNotes::join(all);
    EXPECT_TRUE(joined.ok());
    if (!joined) return found;
    found.counts = joined->counts;
    for (const auto& [at, part] : undecided) found.parts[at] = joined->decided(part.first, part.second);
    return found;
}

/// Finds the same slowly: parts by spreading from triangle to triangle, edges by a map.
Found countedIn(const Soup& soup) {
    std::map<std::pair<Point, Point>, int> edges;
    std::map<Point, std::vector<size_t>> around;
    for (size_t k = 0; k < soup.size(); ++k)
        for (int i = 0; i < 3; ++i) {
            const auto ends = std::minmax({pointOf(soup[k].corner[i]), pointOf(soup[k].corner[(i + 1) % 3])});
            ++edges[{ends.first, ends.second}];
            around[pointOf(soup[k].corner[i])].push_back(k);
        }
    Found found;
    for (const auto& [start, triangles] : around) {
        if (found.parts.contains(start)) continue;
        std::set<Point> part{start};
        std::vector<Point> next{start};
        while (!next.empty()) {
            const Point at = next.back();
            next.pop_back();
            for (const size_t k : around[at])
                for (const glm::i32vec3 p : soup[k].corner)
                    if (part.insert(pointOf(p)).second) next.push_back(pointOf(p));
        }
        uint64_t open = 0;
        for (const auto& [ends, count] : edges) open += part.contains(ends.first) && count % 2 == 1 ? 1 : 0;
        found.counts.openEdges += open;
        ++found.counts.parts;
        found.counts.closed += open == 0 ? 1 : 0;
        for (const Point& p : part) found.parts[p] = open == 0 ? kClosedPart : kOpenPart;
    }
    return found;
}

void expectSame(const Found& found, const Found& counted) {
    EXPECT_EQ(found.counts.parts, counted.counts.parts);
    EXPECT_EQ(found.counts.closed, counted.counts.closed);
    EXPECT_EQ(found.counts.openEdges, counted.counts.openEdges);
    EXPECT_EQ(found.parts, counted.parts);
}

TEST(ClosedParts, AMissingTriangleOpensAPart) {
    Soup soup = test::soupOf(test::sphereMesh({20, 20, 20}, 9, 12));
    const Found whole = foundIn(soup, PagePartition());
    EXPECT_EQ(whole.counts.parts, 1u);
    EXPECT_EQ(whole.counts.closed, 1u);
    EXPECT_EQ(whole.counts.openEdges, 0u);
    soup.erase(soup.begin() + 40);
    const Found open = foundIn(soup, PagePartition());
    EXPECT_EQ(open.counts.parts, 1u);
    EXPECT_EQ(open.counts.closed, 0u);
    EXPECT_EQ(open.counts.openEdges, 3u);
}

TEST(ClosedParts, EveryPartitionFindsWhatASlowCountFinds) {
    for (uint64_t seed = 0; seed < 8; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937_64 random(seed);
        const auto any = [&](double from, double to) {
            return std::uniform_real_distribution<double>(from, to)(random);
        };
        Soup soup;
        for (int i = 0; i < 6; ++i) {
            const glm::dvec3 centre(any(15, 49), any(15, 49), any(15, 49));
            Soup part = test::soupOf(i % 2 == 0 ? test::sphereMesh(centre, any(1, 10), 7)
                                                : test::torusMesh(centre, any(6, 9), any(1, 3), 11, 5));
            if (i > 2) part.erase(part.begin() + ptrdiff_t(random() % part.size()));
            soup.insert(soup.end(), part.begin(), part.end());
        }
        const Found counted = countedIn(soup);
        EXPECT_EQ(counted.counts.closed, 3u);
        EXPECT_EQ(counted.counts.openEdges, 9u);
        expectSame(foundIn(soup, PagePartition()), counted);
        expectSame(foundIn(soup, partitionOf(seed)), counted);
    }
}

// A sliver without area has the edges that its neighbours go on by.
TEST(ClosedParts, SliversWithoutAreaKeepASurfaceClosed) {
    const glm::i32vec3 a{100, 100, 100}, b{900, 100, 100}, m{500, 100, 100}, c{500, 900, 100}, d{500, 400, 800};
    Soup soup;
    for (const auto& [p, q, r] :
         std::vector<Corners>{{a, m, c}, {m, b, c}, {a, m, b}, {a, b, d}, {b, c, d}, {c, a, d}}) {
        LatticeTriangle t{};
        t.corner[0] = p, t.corner[1] = q, t.corner[2] = r;
        soup.push_back(t);
    }
    EXPECT_EQ(foundIn(soup, PagePartition()).counts.closed, 1u);
    soup.erase(soup.begin() + 2);
    EXPECT_EQ(foundIn(soup, PagePartition()).counts.openEdges, 3u);
}

// One of two sides on the same triangles stays, so a sheet with two sides is open.
TEST(ClosedParts, ASheetWithTwoSidesIsOpen) {
    Soup soup = test::soupOf(
        test::gridSurface(5, 5, false, [](double u, double v) { return glm::dvec3(10 + 8 * u, 10 + 8 * v, 20); }));
    const size_t count = soup.size();
    for (size_t k = 0; k < count; ++k) {
        soup.push_back(soup[k]);
        std::swap(soup.back().corner[0], soup.back().corner[1]);
    }
    const Found found = foundIn(soup, PagePartition());
    EXPECT_EQ(found.counts.closed, 0u);
    EXPECT_GT(found.counts.openEdges, 0u);
}

}  // namespace
}  // namespace vcp
