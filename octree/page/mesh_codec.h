// Codes the triangles of the hard leaves: the surface grows across its edges, vertices are predicted by the
// parallelogram rule (Touma and Gotsman 1998) and the plane behind it, normals from the triangles; which leaf holds
// which triangle follows from where they are. Triangles that share an edge share their mark. Part of page_codec.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <optional>

#include "octree/page/codec_page.h"
#include "octree/page/mesh_source.h"
#include "octree/page/range_coder.h"
#include "octree/surface/leaf_triangles.h"
#include "octree/surface/packing.h"
#include "octree/surface/triangle_front.h"
#include "octree/surface/vertex_normal.h"

namespace vcp {

template <class Coder>
class MeshCodec {
public:
    MeshCodec(Coder& coder, CodecPage& page)
        : coder_(coder),
          page_(page),
          hardLeaves_(numberLeaves(page)),
          places_(page.header.root, page.nodes, page.header.log2Cells),
          front_(page.header.vertices) {}

    void run() {
        uint32_t count = 0;
        if constexpr (Coder::kEncodes) {
            source_ = MeshSource(*page_.source);
            if (source_.wrong()) page_.wrong = true;
            count = source_.triangles();
        }
        count_.code(coder_, count);
        if (count > page_.mostEntries) page_.wrong = true;
        if (count == 0 && hardLeaves_ + page_.header.vertices > 0) page_.wrong = true;
        if (page_.wrong || count == 0) return;
        positions_.reserve(page_.header.vertices);
        triangles_.reserve(count);
        while (triangles_.size() < count && !page_.wrong) codeTriangle();
        if (positions_.size() != page_.header.vertices) page_.wrong = true;
        if (!page_.wrong) fillLeaves();
        if (!page_.wrong) codeNormals();
    }

private:
    static constexpr uint32_t kNone = TriangleFront::kNone;

    /// Writes each hard leaf's number into its word, so that places_ tells the leaves apart.
    static uint32_t numberLeaves(CodecPage& page) {
        uint32_t count = 0;
        page.forEachNode([&](uint32_t& word, uint32_t, const NodePlace&) {
            if (nodeType(word) == kNodeHard) word = kNodeHard << kNodeTypeShift | count++;
        });
        return count;
    }

    void codeTriangle() {
        const uint32_t g = front_.first();
        if (g == kNone) return codeSeed();
        const TriangleFront::Gate gate = front_.gate(g);
        uint32_t behind = kNone;  // encoder: the triangle's number in source_
        if constexpr (Coder::kEncodes) behind = source_.across(gate.from, gate.to);
        bool none = behind == kNone;
        coder_.bit(border_[inHard(gate)][lastBorder_], none);
        lastBorder_ = (lastBorder_ << 1 | (none ? 1u : 0u)) & 7u;
        if (none) return front_.closeGate(g);
        uint32_t c = kNone;
        if constexpr (Coder::kEncodes) c = source_.thirdVertex(behind, gate.from, gate.to);
        codeThird(g, gate, c);
        if (page_.wrong) return;
        front_.attach(g, c);
        add(gate.to, gate.from, c, behind);
    }

    /// Codes vertex c of the triangle behind a gate; in the encoder c is kNone when the vertex is new.
    void codeThird(uint32_t g, const TriangleFront::Gate& gate, uint32_t& c) {
        const uint32_t next = front_.nextVertex(g), previous = front_.previousVertex(g);
        const uint32_t from = degreeClass(gate.from), to = degreeClass(gate.to);
        const uint32_t ends = (next != kNone ? 1u : 0u) | (previous != kNone ? 2u : 0u);
        bool fresh = c == kNone;
        coder_.bit(fresh_[ends][from][to], fresh);
        if (fresh) {
            c = uint32_t(positions_.size());
            return codeVertex(gate);
        }
        if (next != kNone) {
            bool is = c == next;
            coder_.bit(next_[ends][from][to], is);
            if (is) c = next;
            if (is) return check(gate, c);
        }
        if (previous != kNone) {
            bool is = c == previous;
            coder_.bit(previous_[ends][from][to], is);
            if (is) c = previous;
            if (is) return check(gate, c);
        }
        codeKnown(c);
        check(gate, c);
    }

    void check(const TriangleFront::Gate& gate, uint32_t c) {
        if (c == gate.from || c == gate.to) page_.wrong = true;
    }

    /// Codes a vertex by its number, counted from the latest.
    void codeKnown(uint32_t& c) {
        const uint32_t latest = uint32_t(positions_.size());
        uint32_t back = latest - 1 - c;
        known_.code(coder_, back);
        c = latest - 1 - back;
        if (back >= latest) page_.wrong = true;
    }

    /// Codes a triangle that no edge leads to.
    void codeSeed() {
        Index3 t{kNone, kNone, kNone}, old{};
        uint32_t number = kNone;
        if constexpr (Coder::kEncodes) {
            number = source_.nextSeed();
            old = source_.vertices(number);
        }
        bool isOpen = Coder::kEncodes && isOpenVertex(page_.source->vertices[old[0]]);
        if (page_.hasMarks) coder_.bit(open_, isOpen);
        for (size_t i = 0; i < 3 && !page_.wrong; ++i) {
            if constexpr (Coder::kEncodes) t[i] = source_.numberOf(old[i]);
            bool fresh = t[i] == kNone;
            coder_.bit(seedFresh_[i], fresh);
            if (!fresh) {
                if (positions_.empty())
                    page_.wrong = true;
                else
                    codeKnown(t[i]);
                continue;
            }
            t[i] = uint32_t(positions_.size());
            const glm::i32vec3 near = i > 0                ? positions_[t[0]]
                                      : positions_.empty() ? glm::i32vec3(0)
                                                           : positions_.back();
            glm::i32vec3 more(0);
            if constexpr (Coder::kEncodes) more = source_.take(old[i], t[i]) - near;
            for (int axis = 0; axis < 3; ++axis) seedVertex_[i > 0 ? 1 : 0].code(coder_, more[axis]);
            place(near + more);
            mark(isOpen);
        }
        if (page_.wrong) return;
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
            page_.wrong = true;
            return;
        }
        front_.begin(t[0], t[1], t[2]);
        add(t[0], t[1], t[2], number);
    }

    void codeVertex(const TriangleFront::Gate& gate) {
        const glm::i32vec3 a = positions_[gate.from], b = positions_[gate.to], o = positions_[gate.opposite];
        const glm::i32vec3 foretold = a + b - o;
        glm::i32vec3 more(0);
        if constexpr (Coder::kEncodes) more = source_.takeThird(uint32_t(positions_.size())) - foretold;
        const glm::i32vec3 u = b - a, v = o - a;
        const int32_t size = std::max(largest(u), largest(v));
        const WideVector n = areaNormal(a, b, o);
        const WideVector m(std::abs(n.x), std::abs(n.y), std::abs(n.z));
        const int k = m.x >= m.y && m.x >= m.z ? 0 : m.y >= m.z ? 1 : 2, i = (k + 1) % 3, j = (k + 2) % 3;
        const uint32_t scale = uint32_t(std::clamp(int(std::bit_width(uint32_t(size))) - 7, 0, 5));
        const std::array<bool, 3> known = codeLevel(gate, foretold, more);
        if (!known[size_t(i)]) vertex_[scale][0].code(coder_, more[i]);
        const uint32_t spread = category(more[i], scale);
        if (!known[size_t(j)]) vertex_[scale][1 + spread].code(coder_, more[j]);
        if (!known[size_t(k)]) {
            // Where the surface continues flat, the third coordinate follows from the other two.
            int32_t flat = 0;
            if (size <= kFlatSteps && n[k] != 0)
                flat = int32_t(-(n[i] * std::clamp(more[i], -kFlatSteps, kFlatSteps) +
                                 n[j] * std::clamp(more[j], -kFlatSteps, kFlatSteps)) /
                               n[k]);
            int32_t rest = more[k] - flat;
            height_[scale][std::max(spread, category(more[j], scale))].code(coder_, rest);
            more[k] = rest + flat;
        }
        place(foretold + more);
        mark(isMarked(gate.from));
    }

    /// For walls and isosurfaces: codes which coordinates are those of a corner of the gate's triangle. Sets `more`.
    std::array<bool, 3> codeLevel(const TriangleFront::Gate& gate, glm::i32vec3 foretold, glm::i32vec3& more) {
        const glm::i32vec3 corner[3] = {positions_[gate.from], positions_[gate.to], positions_[gate.opposite]};
        uint32_t which[3] = {0, 0, 0};  // 1 + the corner's number, 0: none
        if constexpr (Coder::kEncodes)
            for (int axis = 0; axis < 3; ++axis)
                for (uint32_t c = 3; c-- > 0;)
                    if (foretold[axis] + more[axis] == corner[c][axis]) which[axis] = 1 + c;
        bool any = (which[0] | which[1] | which[2]) != 0;
        coder_.bit(anyLevel_[lastLevel_], any);
        lastLevel_ = (lastLevel_ << 1 | (any ? 1u : 0u)) & 7u;
        std::array<bool, 3> known{};
        if (!any) return known;
        for (int axis = 0; axis < 3; ++axis) {
            const uint32_t ends = (corner[0][axis] == corner[1][axis] ? 1u : 0u) |
                                  (corner[0][axis] == corner[2][axis] ? 2u : 0u) |
                                  (corner[1][axis] == corner[2][axis] ? 4u : 0u);
            coder_.symbol(level_[ends], which[axis]);
            if (which[axis] > 3) page_.wrong = true;
            known[size_t(axis)] = which[axis] != 0;
            if (which[axis] != 0) more[axis] = corner[(which[axis] - 1) % 3][axis] - foretold[axis];
        }
        return known;
    }

    /// Classes how far off a prediction was, against the edges' size: 0 to 3.
    static uint32_t category(int32_t more, uint32_t scale) {
        const int bits = int(std::bit_width(uint32_t(std::abs(more)))) - int(scale) - 3;
        return uint32_t(std::clamp(bits, 0, 3));
    }
    static int32_t largest(glm::i32vec3 v) { return std::max(std::abs(v.x), std::max(std::abs(v.y), std::abs(v.z))); }

    void place(glm::i32vec3 position) {
        const uint32_t number = uint32_t(positions_.size());
        const glm::i32vec3 p = position + kLatticeBias;
        if (number >= page_.header.vertices || std::min(p.x, std::min(p.y, p.z)) < 0 ||
            std::max(p.x, std::max(p.y, p.z)) > int(kField21Mask)) {
            page_.wrong = true;
            return;
        }
        page_.vertices[number] = pack21(uint32_t(p.x), uint32_t(p.y), uint32_t(p.z));
        positions_.push_back(position);
        inHard_.push_back(places_.typeAt(position) == kNodeHard ? 1 : 0);
    }

    /// Gives the latest vertex its mark.
    void mark(bool isOpen) {
        if (isOpen && !page_.wrong) page_.vertices[positions_.size() - 1].y |= kVertexOpenBit;
    }
    [[nodiscard]] bool isMarked(uint32_t vertex) const { return isOpenVertex(page_.vertices[vertex]); }

    void add(uint32_t a, uint32_t b, uint32_t c, uint32_t number) {
        if constexpr (Coder::kEncodes) source_.done(number, uint32_t(triangles_.size()));
        triangles_.push_back({a, b, c});
        const glm::i32vec3 u = positions_[b] - positions_[a], v = positions_[c] - positions_[a];
        if (std::max(largest(u), std::max(largest(v), largest(u - v))) > kMaxEdgeSteps) page_.wrong = true;
    }

    /// The page has all triangles at a vertex inside a hard leaf, and both triangles at an edge through one.
    uint32_t inHard(const TriangleFront::Gate& gate) const {
        const uint32_t ends = uint32_t{inHard_[gate.from]} + inHard_[gate.to];
        if (ends > 0) return 1 + ends;
        const glm::i32vec3 a = positions_[gate.from], b = positions_[gate.to];
        return places_.typeAt({(a.x + b.x) >> 1, (a.y + b.y) >> 1, (a.z + b.z) >> 1}) == kNodeHard ? 1 : 0;
    }
    uint32_t degreeClass(uint32_t vertex) const { return std::min(front_.degree(vertex), 7u); }

    /// Makes the hard leaves' strips, in the order of the leaves, and their words.
    void fillLeaves() {
        const std::optional<LeafLists> lists = Coder::kEncodes ? listsOfSource() : findLists(page_.mostEntries);
        if (!lists) {
            page_.wrong = true;
            return;
        }
        std::vector<Index3> list;
        page_.forEachNode([&](uint32_t& word, uint32_t, const NodePlace&) {
            if (nodeType(word) != kNodeHard) return;
            list.clear();
            for (const uint32_t t : lists->of(word & kNodePayloadMask)) list.push_back(triangles_[t]);
            if (list.empty() || page_.entries.size() > kHardFirstMask)
                page_.wrong = true;
            else
                word = appendHardLeaf(list, page_.entries);
        });
        if (page_.entries.size() > page_.mostEntries) page_.wrong = true;
    }

    /// How many nodes may be looked at for the lists of a page whose leaves name so many triangles.
    static uint64_t mostVisits(uint32_t named) { return uint64_t{256} * named + 65536; }

    /// Encoder: returns the leaves' lists, each ascending, or nothing where the decoder would not find the same.
    std::optional<LeafLists> listsOfSource() {
        LeafLists lists;
        lists.triangles.reserve(page_.source->lists.triangles.size());
        page_.forEachNode([&](uint32_t word, uint32_t source, const NodePlace&) {
            if (nodeType(word) != kNodeHard) return;
            for (const uint32_t t : page_.source->lists.of(draftList(source)))
                lists.triangles.push_back(source_.newNumber(t));
            std::sort(lists.triangles.begin() + lists.begin.back(), lists.triangles.end());
            lists.endList();
        });
        const uint32_t named = uint32_t(lists.triangles.size());
        const bool isFound = page_.source->listsAreCertain && visitsAtMost() <= mostVisits(named);
        assert(!isFound || findLists(named) == lists);
        if (!isFound && findLists(named) != lists) return {};
        return lists;
    }

    /// Returns a bound for the nodes that are looked at for all lists.
    [[nodiscard]] uint64_t visitsAtMost() const {
        const uint64_t inCell = places_.mostNodesInCell();
        uint64_t visits = 0;
        for (const auto& [a, b, c] : triangles_)
            visits += 1 + places_.cellsAround({positions_[a], positions_[b], positions_[c]}) * (1 + inCell);
        return visits;
    }

    /// Finds the lists, each ascending. Returns nothing where they name more than `most` triangles.
    std::optional<LeafLists> findLists(uint32_t most) const {
        struct Entry {
            uint32_t leaf, triangle;
        };
        std::vector<Entry> entries;
        entries.reserve(2 * triangles_.size());
        uint64_t work = mostVisits(most);
        for (uint32_t t = 0; t < triangles_.size(); ++t) {
            const auto& [a, b, c] = triangles_[t];
            const uint64_t visits =
                places_.hardLeavesOf({positions_[a], positions_[b], positions_[c]}, [&](uint32_t word) {
                    entries.push_back({word & kNodePayloadMask, t});
                });
            if (entries.size() > most || visits > work) return {};
            work -= visits;
        }
        LeafLists lists;
        lists.begin.assign(size_t{hardLeaves_} + 1, 0);
        for (const Entry& e : entries) ++lists.begin[e.leaf + 1];
        for (uint32_t leaf = 0; leaf < hardLeaves_; ++leaf) lists.begin[leaf + 1] += lists.begin[leaf];
        lists.triangles.resize(entries.size());
        std::vector<uint32_t> next(lists.begin.begin(), lists.begin.end() - 1);
        for (const Entry& e : entries) lists.triangles[next[e.leaf]++] = e.triangle;
        return lists;
    }

    void codeNormals() {
        std::vector<WideVector> sums(positions_.size(), WideVector(0));
        std::vector<WideVector> normals(triangles_.size());
        for (size_t t = 0; t < triangles_.size(); ++t) {
            const Index3& i = triangles_[t];
            normals[t] = areaNormal(positions_[i[0]], positions_[i[1]], positions_[i[2]]);
            for (const uint32_t v : i) addNormal(sums[v], normals[t]);
        }
        const std::vector<uint8_t> crease = creases(normals, sums, triangles_);
        for (uint32_t v = 0; v < positions_.size(); ++v) codeNormal(v, normalGridPoint(sums[v]), crease[v]);
        if constexpr (Coder::kEncodes) page_.vertexSource = source_.vertexOrder();
    }

    void codeNormal(uint32_t v, NormalGridPoint foretold, uint8_t crease) {
        uint32_t source = 0;
        if constexpr (Coder::kEncodes) source = page_.source->normals[source_.vertexOrder()[v]];
        NormalGridPoint point{};
        bool plain = Coder::kEncodes && !gridPointOf(source, point);
        coder_.bit(plainNormal_, plain);
        if (plain) {
            uint32_t low = source & 0xffffu, high = source >> 16;
            coder_.raw(low, 16);
            coder_.raw(high, 16);
            page_.normals[v] = low | high << 16;
            return;
        }
        bool bent = (source & kNormalCreaseBit) != 0;
        coder_.bit(crease_[inHard_[v]][crease], bent);
        bool other = point.u != foretold.u || point.v != foretold.v;
        coder_.bit(otherNormal_[inHard_[v]], other);
        if (other) {
            int32_t du = int32_t(point.u) - int32_t(foretold.u), dv = int32_t(point.v) - int32_t(foretold.v);
            const uint32_t context = (crease != 0 ? 1u : 0u) + (bent ? 2u : 0u);
            normal_[context].code(coder_, du);
            normal_[4 + context].code(coder_, dv);
            point = {foretold.u + uint32_t(du), foretold.v + uint32_t(dv)};
            if (std::max(point.u, point.v) > kNormalSteps) {
                page_.wrong = true;
                return;
            }
        } else {
            point = foretold;
        }
        page_.normals[v] = packGridNormal(point, bent);
    }

    static constexpr int32_t kFlatSteps = 1 << 17;

    Coder& coder_;
    CodecPage& page_;
    uint32_t hardLeaves_;
    NodePlaces places_;
    TriangleFront front_;
    MeshSource source_;                    ///< the triangles that the encoder codes
    std::vector<glm::i32vec3> positions_;  ///< the vertices' positions on the lattice, from the page's lowest corner
    std::vector<uint8_t> inHard_;          ///< whether a vertex is in a hard leaf
    std::vector<Index3> triangles_;
    uint32_t lastBorder_ = 0, lastLevel_ = 0;
    NumberModel count_, known_;
    BitModel border_[4][8], fresh_[4][8][8], next_[4][8][8], previous_[4][8][8], seedFresh_[3];
    SignedModel seedVertex_[2], vertex_[6][5], height_[6][4], normal_[8];
    BitModel anyLevel_[8];
    SymbolModel level_[8];
    BitModel plainNormal_, crease_[2][2], otherNormal_[2], open_;
};

}  // namespace vcp
