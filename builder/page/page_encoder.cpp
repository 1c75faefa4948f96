#include "builder/page/page_encoder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "octree/page/page.h"
#include "octree/surface/clearance.h"
#include "octree/surface/leaf_math.h"
#include "octree/surface/packing.h"
#include "octree/surface/position_map.h"

namespace vcp {

namespace {

/// Returns corner i of a leaf that is corner c of the face at end `end` of `axis`.
int cornerOfFace(int axis, int end, int c) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    return end << axis | (c & 1) << u | (c >> 1) << v;
}

/// The soft leaves by position, to find neighbours.
class LeafMap {
public:
    explicit LeafMap(const std::vector<SoftLeaf>& leaves) {
        map_.reserve(leaves.size());
        for (uint32_t i = 0; i < leaves.size(); ++i) map_.emplace(key(leaves[i].box), i);
    }
    /// Returns the number of the leaf with exactly this box, or -1.
    [[nodiscard]] int64_t find(const NodeBox& box) const {
        const auto entry = map_.find(key(box));
        return entry == map_.end() ? -1 : int64_t{entry->second};
    }

private:
    static uint64_t key(const NodeBox& box) {
        return uint64_t(uint32_t(box.lower.x) & 0xffffu) | uint64_t(uint32_t(box.lower.y) & 0xffffu) << 16 |
               uint64_t(uint32_t(box.lower.z) & 0xffffu) << 32 | uint64_t(uint32_t(box.edge)) << 48;
    }
    std::unordered_map<uint64_t, uint32_t> map_;
};

NodeBox neighbour(const NodeBox& box, int axis, int end) {
    NodeBox n = box;
    n.lower[axis] += end ? box.edge : -box.edge;
    return n;
}

/// Whether two equal leaves agree on the sides of the corners of the face between them: 1 yes, -1 all are flipped, 0
/// neither.
int sideAgreement(const SoftLeaf& a, const SoftLeaf& b, int axis, int endOfA) {
    int same = 0;
    for (int c = 0; c < 4; ++c) {
        const uint32_t ca = a.certificate.codes[cornerOfFace(axis, endOfA, c)],
                       cb = b.certificate.codes[cornerOfFace(axis, 1 - endOfA, c)];
        if (ca == cb)
            ++same;
        else if (ca == flipSide(cb))
            --same;
    }
    return same == 4 ? 1 : same == -4 ? -1 : 0;
}

/// Sets wall codes. A leaf needs its wall tolerance unless, at each face that the surface comes near, an equal leaf
/// with the same f continues it.
void setWalls(PageTree& tree, const LeafMap& map) {
    for (SoftLeaf& leaf : tree.soft) {
        const BernsteinCube cube(LeafSurface(leaf.certificate.codes), 0, 1);
        const double near = 1.05 * leaf.certificate.maxValue + 1e-4;
        bool continued = true;
        for (int face = 0; face < 6 && continued; ++face) {
            const int axis = face / 2, end = face % 2;
            const BernsteinCube::Range range = cube.faceRange(axis, end);
            if (range.min > near || range.max < -near) continue;
            const int64_t next = map.find(neighbour(leaf.box, axis, end));
            continued = next >= 0 && sideAgreement(leaf, tree.soft[size_t(next)], axis, end) != 0;
        }
        leaf.wall = continued ? 0 : wallCode(leaf.certificate.maxValue);
    }
}

/// The faces array: leaves in runs along an axis, neighbours sharing the face between them.
class FacePacker {
public:
    FacePacker(const PageTree& tree, const LeafMap& map, bool withColour)
        : tree_(tree),
          map_(map),
          withColour_(withColour),
          first_(tree.soft.size(), kUnset),
          axis_(tree.soft.size(), 0) {
        for (uint32_t i = 0; i < tree.soft.size(); ++i)
            if (first_[i] == kUnset) packRun(i);
    }

    [[nodiscard]] uint32_t firstFace(uint32_t leaf) const { return first_[leaf]; }
    [[nodiscard]] uint32_t axis(uint32_t leaf) const { return axis_[leaf]; }
    std::vector<uint4> faces, colours;

private:
    static constexpr uint32_t kUnset = 0xffffffff;

    struct Link {
        uint32_t leaf;
        bool flip;
    };

    /// The unpacked leaves that continue `leaf` along the axis, itself first.
    std::vector<Link> runFrom(uint32_t leaf, int axis) const {
        std::vector<Link> run{{leaf, false}};
        for (;;) {
            const SoftLeaf& last = tree_.soft[run.back().leaf];
            const int64_t next = map_.find(neighbour(last.box, axis, 1));
            if (next < 0 || first_[size_t(next)] != kUnset) return run;
            const int agreement = sideAgreement(last, tree_.soft[size_t(next)], axis, 1);
            if (agreement == 0) return run;
            run.push_back({uint32_t(next), run.back().flip != (agreement < 0)});
        }
    }

    /// Leaves come in the octree's order: nothing unpacked lies before `leaf` on most axes, so runs start here.
    void packRun(uint32_t leaf) {
        std::vector<Link> best;
        int bestAxis = 0;
        for (int axis = 0; axis < 3; ++axis) {
            std::vector<Link> run = runFrom(leaf, axis);
            if (run.size() > best.size()) {
                best = std::move(run);
                bestAxis = axis;
            }
        }
        for (const Link& link : best) {
            first_[link.leaf] = uint32_t(faces.size());
            axis_[link.leaf] = uint32_t(bestAxis);
            addFace(link, bestAxis, 0);
        }
        addFace(best.back(), bestAxis, 1);
    }

    void addFace(const Link& link, int axis, int end) {
        const SoftLeaf& leaf = tree_.soft[link.leaf];
        uint4 face(0), colour(0);
        for (int c = 0; c < 4; ++c) {
            const int corner = cornerOfFace(axis, end, c);
            const uint32_t code = leaf.certificate.codes[corner];
            face[c] = link.flip ? flipSide(code) : code;
            colour[c] = leaf.colours[size_t(corner)];
        }
        faces.push_back(face);
        if (withColour_) colours.push_back(colour);
    }

    const PageTree& tree_;
    const LeafMap& map_;
    bool withColour_;
    std::vector<uint32_t> first_, axis_;
};

/// Marks the cells of the page that hold a part of the mesh.
Clearance clearanceOf(const PageTree& tree) {
    const int n = tree.cells;
    Clearance clearance(n);
    for (int z = 0; z < n; ++z)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x)
                if (tree.occupied[size_t(x + n * (y + n * z))] != 0) clearance.occupy({x, y, z}, 1);
    return clearance;
}

/// Gives the triangles of the hard leaves and their vertices numbers in the page.
class TrianglePacker {
public:
    TrianglePacker(const PageTree& tree, const LatticeMesh& mesh, bool withMarks, PageDraft& draft)
        : tree_(tree),
          mesh_(mesh),
          withMarks_(withMarks),
          draft_(draft),
          numbers_(tree.triangles.size(), kNone),
          local_(tree.triangles.size()) {}

    /// Appends a leaf's list; returns its node word.
    uint32_t add(const HardLeaf& leaf) {
        for (const uint32_t k : leaf.triangles) {
            if (numbers_[k] == kNone) numbers_[k] = triangle(tree_.triangles[k]);
            draft_.lists.triangles.push_back(numbers_[k]);
        }
        return draftLeaf(draft_.lists.endList());
    }

    std::vector<uint32_t> colours;
    std::vector<TexturePoint> points;

    /// Whether some triangle has an image.
    [[nodiscard]] bool isTextured() const {
        return std::ranges::any_of(points, [](const TexturePoint& point) { return point.material != 0; });
    }

private:
    static constexpr uint32_t kNone = 0xffffffff;

    uint32_t triangle(uint32_t global) {
        const auto& v = mesh_.triangles[global];
        const auto place = mesh_.textures.empty() ? std::array<TexturePoint, 3>{} : mesh_.textures[global];
        const auto at = [&](size_t i) { return vertex(v[i], {mesh_.normalOf(global, i), place[i]}); };
        draft_.triangles.push_back({at(0), at(1), at(2)});
        return uint32_t(draft_.triangles.size() - 1);
    }

    /// What a triangle has at a corner of its own.
    struct Corner {
        uint32_t normal;
        TexturePoint place;
    };

    /// Whether a vertex of the page is that of a corner.
    [[nodiscard]] bool isOf(uint32_t number, const Corner& corner) const {
        return draft_.normals[number] == corner.normal && points[number] == corner.place;
    }

    /// Returns the number of a vertex: where triangles have it with different normals, or in different places of
    /// images, it is there for each.
    uint32_t vertex(uint32_t global, const Corner& corner) {
        uint32_t& latest = local_.findOrAdd(global);  // plus 1
        for (uint32_t number = latest; number != 0; number = next_[number - 1])
            if (isOf(number - 1, corner)) return number - 1;
        const glm::i32vec3 p = mesh_.positions[global] - tree_.originLattice + kLatticeBias;
        draft_.vertices.push_back(pack21(uint32_t(p.x), uint32_t(p.y), uint32_t(p.z)));
        if (withMarks_ && mesh_.parts[global] == kOpenPart) draft_.vertices.back().y |= kVertexOpenBit;
        draft_.normals.push_back(corner.normal);
        if (!mesh_.colours.empty()) colours.push_back(mesh_.colours[global]);
        points.push_back(corner.place);
        next_.push_back(latest);
        latest = uint32_t(draft_.vertices.size());
        return latest - 1;
    }

    const PageTree& tree_;
    const LatticeMesh& mesh_;
    bool withMarks_;
    PageDraft& draft_;
    std::vector<uint32_t> numbers_;  ///< of triangles, by local number
    PositionMap<uint32_t> local_;    ///< the latest of the mesh's vertex, plus 1
    std::vector<uint32_t> next_;     ///< the one before it, likewise; 0: none
};

/// Node words in breadth-first groups, so that children come after their parent.
class NodePacker {
public:
    NodePacker(const PageTree& tree, const FacePacker& faces, TrianglePacker& triangles, bool withMarks,
               Clearance& clearance)
        : tree_(tree), faces_(faces), triangles_(triangles), withMarks_(withMarks), clearance_(clearance) {
        std::vector<uint32_t> queue;  // internal nodes, one a group
        root = word(0, queue);
        for (size_t i = 0; i < queue.size(); ++i)
            for (uint32_t c = 0; c < 8; ++c) words.push_back(word(tree_.nodes[queue[i]].index + c, queue));
    }

    uint32_t root = 0;
    std::vector<uint32_t> words;

private:
    uint32_t word(uint32_t node, std::vector<uint32_t>& queue) {
        const TreeNode& n = tree_.nodes[node];
        switch (n.kind) {
            case TreeNode::Kind::Internal:
                queue.push_back(node);
                return kNodeInternal << kNodeTypeShift | uint32_t(queue.size() - 1);
            case TreeNode::Kind::Soft: {
                const SoftLeaf& leaf = tree_.soft[n.index];
                return kNodeSoft << kNodeTypeShift | dipCode(leaf.certificate.curvature) << kSoftDipShift |
                       leaf.wall << kSoftWallShift | faces_.axis(n.index) << kSoftAxisShift | faces_.firstFace(n.index);
            }
            case TreeNode::Kind::Hard:
                return triangles_.add(tree_.hard[n.index]);
            case TreeNode::Kind::Slab: {
                const SlabLeaf& leaf = tree_.slabs[n.index];
                return slabNode(leaf.octants, uint32_t(4 * faces_.faces.size()) + n.index) |
                       (withMarks_ && leaf.parts == kPageHasOpen ? kSlabOpenBit : 0u);
            }
            default:
                return emptyNode(
                    n.box.edge >= kSubcells ? clearance_.of(n.box.lower / kSubcells, n.box.edge / kSubcells) : 0);
        }
    }

    const PageTree& tree_;
    const FacePacker& faces_;
    TrianglePacker& triangles_;
    bool withMarks_;
    Clearance& clearance_;
};

/// Returns all that separates the page's surface from the mesh, in cells: certified leaves, the level's stray, the
/// slack of hard leaves' triangles (1e-4 cells).
double pageError(const PageTree& tree) { return std::max(tree.certifiedError(), 2e-4) + tree.stray; }

/// The vectors of the slab leaves and their colours, four to a face.
struct SlabVectors {
    explicit SlabVectors(const PageTree& tree) {
        for (const SlabLeaf& leaf : tree.slabs) {
            vectors.push_back(leaf.code);
            colours.push_back(leaf.colour);
        }
    }
    std::vector<uint32_t> vectors, colours;
};

/// Returns the kinds of parts that a page's surface belongs to (PageEntry).
uint8_t partsOf(const PageTree& tree, const LatticeMesh& mesh) {
    uint32_t kinds = 0;
    for (const uint32_t k : tree.triangles) kinds |= mesh.kindOf(k);
    for (const SlabLeaf& leaf : tree.slabs) kinds |= leaf.parts;
    return uint8_t(kinds == (kPageHasClosed | kPageHasOpen) ? kinds | kPageHasMarks : kinds);
}

EncodedPage encode(PageTree& tree, const LatticeMesh& mesh, bool withColour) {
    const LeafMap map(tree.soft);
    setWalls(tree, map);
    FacePacker faces(tree, map, withColour);
    const SlabVectors slabs(tree);
    EncodedPage page;
    PageDraft& draft = page.draft;
    page.parts = partsOf(tree, mesh);
    const bool withMarks = (page.parts & kPageHasMarks) != 0;
    TrianglePacker triangles(tree, mesh, withMarks, draft);
    Clearance clearance = clearanceOf(tree);
    NodePacker nodes(tree, faces, triangles, withMarks, clearance);

    page.certifiedError = pageError(tree);
    page.hardLeaves = uint32_t(tree.hard.size());
    page.slabLeaves = uint32_t(tree.slabs.size());
    page.leaves = uint32_t(tree.soft.size()) + page.slabLeaves + page.hardLeaves;
    const size_t softFaces = faces.faces.size();
    draft.listsAreCertain = tree.listsAreCertain;
    draft.nodes = std::move(nodes.words);
    draft.faces = std::move(faces.faces);
    draft.faces.resize(softFaces + (tree.slabs.size() + 3) / 4, uint4(0));
    copyTo(std::as_writable_bytes(std::span(draft.faces)), 16 * softFaces, slabs.vectors);
    PageHeader& header = draft.header;
    header.log2Cells = uint32_t(std::countr_zero(unsigned(tree.cells)));
    header.root = nodes.root;
    header.groups = uint32_t(draft.nodes.size() / 8);
    header.faces = uint32_t(draft.faces.size());
    header.vertices = uint32_t(draft.vertices.size());
    header.softLeaves = uint32_t(tree.soft.size());
    header.hardLeaves = page.hardLeaves;
    header.slabLeaves = page.slabLeaves;
    header.certifiedError = std::nextafter(float(page.certifiedError), std::numeric_limits<float>::infinity());
    if (withColour && page.leaves > 0) {
        const bool isTextured = triangles.isTextured();
        page.colour.resize(isTextured ? texturedPageBytes(header) : colourPageBytes(header));
        copyTo(page.colour, 0, faces.colours);
        copyTo(page.colour, 16 * softFaces, slabs.colours);
        copyTo(page.colour, uint64_t{16} * header.faces, triangles.colours);
        if (isTextured)
            copyTo(page.colour, uint64_t{16} * header.faces + uint64_t{4} * header.vertices, triangles.points);
    }
    return page;
}

}  // namespace

EncodedPage encodePage(PageTree& tree, const LatticeMesh& mesh) { return encode(tree, mesh, !mesh.colours.empty()); }

EncodedPage encodeSlabPage(PageTree& tree, bool withColour) { return encode(tree, LatticeMesh(), withColour); }

}  // namespace vcp
