// Datasets in memory for tests of the renderer.
#pragma once

#include <cmath>
#include <condition_variable>
#include <cstring>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "octree/reference_caster.h"
#include "render/view/renderer.h"
#include "tests/support/analytic_page.h"
#include "tests/support/soup_page.h"

namespace vcp::test {

/// Returns a cut of several levels: every second page is replaced by its children, down to the finest level.
inline std::vector<uint64_t> mixedCut(const Dataset& dataset) {
    std::vector<uint64_t> cut, open = {0};
    for (size_t i = 0; i < open.size(); ++i) {
        const PageEntry& page = dataset.pages[open[i]];
        if (page.childMask == 0 || (i % 2 == 1 && page.level > 0)) {
            cut.push_back(open[i]);
            continue;
        }
        for (const uint64_t child : childrenOf(page)) open.push_back(child);
    }
    return cut;
}

/// Pages of a dataset, from memory; pages in `broken` cannot be read.
class MemorySource final : public PageSource {
public:
    explicit MemorySource(std::vector<PageBytes> pages) : pages_(std::move(pages)) {}
    Result<PageBytes> read(Request request, bool withColour) const override {
        const uint64_t page = request.number;
        if (broken.contains(page))
            return Error{
                .code = ErrorCode::InvalidInput, .message = "broken", .element = "page " + std::to_string(page)};
        PageBytes bytes = pages_[page];
        if (!withColour) bytes.colour.clear();
        return bytes;
    }
    [[nodiscard]] uint64_t bytesToRead(Request request, bool) const override {
        const PageBytes& page = pages_[request.number];
        return page.geometryBytes().size() + page.colourBytes().size();
    }
    std::set<uint64_t> broken;

private:
    std::vector<PageBytes> pages_;
};

/// Lets one read pass at a time, and remembers what was read.
class TurnstileSource final : public PageSource {
public:
    explicit TurnstileSource(std::shared_ptr<const PageSource> source) : source_(std::move(source)) {}
    Result<PageBytes> read(Request request, bool withColour) const override {
        std::unique_lock lock(mutex_);
        turned_.wait(lock, [&] { return passes_ > 0 || open_; });
        if (open_) return Error{.code = ErrorCode::Cancelled, .message = "closed"};
        --passes_;
        read_.push_back(request.number);
        return source_->read(request, withColour);
    }
    [[nodiscard]] uint64_t bytesToRead(Request request, bool withColour) const override {
        return source_->bytesToRead(request, withColour);
    }
    void interrupt() const override {
        const std::lock_guard lock(mutex_);
        open_ = true;
        turned_.notify_all();
    }
    void letOnePass() const {
        const std::lock_guard lock(mutex_);
        ++passes_;
        turned_.notify_all();
    }
    [[nodiscard]] std::vector<uint64_t> read() const {
        const std::lock_guard lock(mutex_);
        return read_;
    }

private:
    std::shared_ptr<const PageSource> source_;
    mutable std::mutex mutex_;
    mutable std::condition_variable turned_;
    mutable int passes_ = 0;
    mutable bool open_ = false;
    mutable std::vector<uint64_t> read_;
};

struct Scene {
    std::string name;
    std::shared_ptr<Dataset> dataset;
    std::shared_ptr<MemorySource> source;
    std::shared_ptr<PageCache> cache;
    glm::dvec3 boxMin, boxMax;
};

inline Scene sceneOf(std::string name, AnalyticDataset made) {
    Scene scene;
    scene.name = std::move(name);
    FileHeader& header = made.dataset.header;
    header.pages = made.dataset.pages.size();
    scene.boxMin = made.dataset.originOf(made.dataset.pages[0]);
    scene.boxMax = scene.boxMin + made.dataset.edgeOf(made.dataset.pages[0]);
    scene.dataset = std::make_shared<Dataset>(made.dataset);
    scene.source = std::make_shared<MemorySource>(made.pages);
    auto cache = PageCache::fromPages(made.dataset, std::move(made.pages));
    if (!cache) ADD_FAILURE() << cache.error().line();
    scene.cache = std::make_shared<PageCache>(std::move(*cache));
    return scene;
}

inline Scene sphereScene(uint32_t levels = 3, glm::dvec3 origin = glm::dvec3(0), double cell = 1, uint32_t axis = 0) {
    AnalyticOptions o;
    o.levels = levels;
    o.origin = origin;
    o.finestCell = cell;
    o.axis = axis;
    const double edge = cell * std::exp2(double(o.log2Cells + levels - 1));
    return sceneOf("sphere", analyticDataset(sphere(origin + glm::dvec3(0.503, 0.497, 0.501) * edge, 0.41 * edge), o));
}

inline Scene torusScene() {
    AnalyticOptions o;
    o.levels = 3;
    o.axis = 2;
    return sceneOf("torus", analyticDataset(torus(glm::dvec3(32.2, 31.8, 32.1), 19, 7), o));
}

/// One page of hard leaves: a cube from (4,4,4) to (12,12,12) on grid planes, `split` times divided octants
/// that each list all twelve triangles.
inline Scene cubeScene(uint32_t split) {
    PageHeader header;
    header.log2Cells = 4;
    std::vector<glm::u32vec2> vertices;
    std::vector<uint32_t> normals, entries;
    std::vector<Index3> triangles;
    for (uint32_t corner = 0; corner < 8; ++corner) {
        const auto at = [&](uint32_t bit) {
            return uint32_t(((corner >> bit & 1) != 0 ? 12 : 4) * kLatticePerCell + kLatticeBias);
        };
        vertices.push_back(pack21(at(0), at(1), at(2)));
        normals.push_back(packNormal({0, 0, 1}, true));
    }
    for (uint32_t axis = 0; axis < 3; ++axis)
        for (uint32_t side = 0; side < 2; ++side) {
            const uint32_t a = side << axis, u = 1u << (axis + 1) % 3, v = 1u << (axis + 2) % 3;
            triangles.push_back({a, a | u, a | v});
            triangles.push_back({a | u | v, a | v, a | u});
        }
    // Every leaf has strips of its own, as the format wants it.
    const auto leaf = [&] { return appendHardLeaf(triangles, entries); };
    std::vector<uint32_t> nodes;
    uint64_t leaves = 1;
    if (split == 0) {
        header.root = leaf();
    } else {
        // Groups breadth first: the last layer holds the leaves.
        header.root = 0;
        uint32_t groupsInLayer = 1, firstOfNext = 1;
        for (uint32_t layer = 0; layer < split; ++layer, groupsInLayer *= 8)
            for (uint32_t node = 0; node < groupsInLayer * 8; ++node)
                nodes.push_back(layer + 1 < split ? firstOfNext++ : leaf());
        leaves = groupsInLayer;
    }
    header.groups = uint32_t(nodes.size() / 8);
    header.entries = uint32_t(entries.size());
    header.vertices = uint32_t(vertices.size());
    header.hardLeaves = uint32_t(leaves);
    const PageSections s = pageSections(header);
    AnalyticDataset made;
    PageBytes bytes;
    bytes.geometry.resize(s.end / 16);
    auto* out = reinterpret_cast<std::byte*>(bytes.geometry.data());
    std::memcpy(out, &header, sizeof(header));
    if (!nodes.empty()) std::memcpy(out + s.nodes, nodes.data(), nodes.size() * 4);
    std::memcpy(out + s.vertices, vertices.data(), vertices.size() * 8);
    std::memcpy(out + s.normals, normals.data(), normals.size() * 4);
    storeEntries(entries, header.vertices, out + s.strips);
    FileHeader& h = made.dataset.header;
    h.cell = 1;
    h.levels = 1;
    h.log2Cells = 4;
    PageEntry entry;
    entry.pageBytes = uint32_t(bytes.geometryBytes().size());
    entry.leaves = entry.hardLeaves = uint32_t(leaves);
    made.dataset.pages.push_back(entry);
    made.pages.push_back(std::move(bytes));
    return sceneOf("cube" + std::to_string(split), std::move(made));
}

/// One page of hard leaves at a depth: a sheet of n x n squares in waves, every seventh triangle turned over.
inline Scene wavesScene(uint32_t n, uint32_t depth) {
    SoupPage page(4, depth);
    page.clearancePerDepth = 0;
    for (uint32_t y = 0; y <= n; ++y)
        for (uint32_t x = 0; x <= n; ++x) {
            const double u = 1 + 14.0 * x / n, v = 1 + 14.0 * y / n;
            page.vertex(glm::i32vec3(double(kLatticePerCell) * glm::dvec3(u, v, 8 + 2 * std::sin(u) * std::cos(v))));
        }
    uint32_t triangles = 0;
    const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
        triangles++ % 7 == 0 ? page.triangle(a, c, b) : page.triangle(a, b, c);
    };
    for (uint32_t y = 0; y < n; ++y)
        for (uint32_t x = 0; x < n; ++x) {
            const uint32_t a = x + (n + 1) * y, b = a + 1, c = a + n + 1, d = c + 1;
            add(a, b, c);
            add(b, d, c);
        }
    AnalyticDataset made;
    PageBytes bytes;
    bytes.geometry = page.build(n).geometry;
    made.dataset.header.cell = 1;
    made.dataset.header.levels = 1;
    made.dataset.header.log2Cells = 4;
    PageEntry entry;
    entry.pageBytes = uint32_t(bytes.geometryBytes().size());
    entry.leaves = entry.hardLeaves = parsePage(bytes.geometryBytes())->header.hardLeaves;
    made.dataset.pages.push_back(entry);
    made.pages.push_back(std::move(bytes));
    return sceneOf("waves" + std::to_string(n), std::move(made));
}

/// Gives every corner of a scene's pages one colour.
inline void paint(Scene& scene, AnalyticDataset made, uint32_t rgba) {
    made.dataset.header.flags |= kFlagColour;
    for (size_t page = 0; page < made.pages.size(); ++page) {
        PageHeader header;
        std::memcpy(&header, made.pages[page].geometryBytes().data(), sizeof(header));
        made.pages[page].colour.assign(colourPageBytes(header) / 16, uint4(rgba));
        made.dataset.pages[page].colourBytes = uint32_t(colourPageBytes(header));
    }
    scene = sceneOf("painted", std::move(made));
}

}  // namespace vcp::test
