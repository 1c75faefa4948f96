#include "viewer/export/page_surface.h"

#include <algorithm>

#include <glm/common.hpp>

#include "octree/page/page_draft.h"
#include "octree/page_reader.h"
#include "octree/surface/packing.h"

namespace vcp {

namespace {

void dropUnusedPoints(PolygonMesh& mesh) {
    constexpr uint32_t kUnused = UINT32_MAX;
    std::vector<uint32_t> number(mesh.points.size(), kUnused);
    std::vector<ColouredPoint> kept;
    for (Index3& t : mesh.triangles)
        for (uint32_t& v : t) {
            if (number[v] == kUnused) {
                number[v] = uint32_t(kept.size());
                kept.push_back(mesh.points[v]);
            }
            v = number[v];
        }
    mesh.points.swap(kept);
}

class PageWalk {
public:
    PageWalk(const SurfaceCut& cut, const PageView& view, ExportedPage& out)
        : cut_(cut), view_(view), out_(out), origin_(cut.originOf(out.page)), shift_(cut.shiftOf(out.page)) {}

    void run() {
        const double cell = cut_.dataset().cellOf(cut_.dataset().pages[out_.page].level);
        const double certified = double(cut_.dataset().pages[out_.page].certifiedError);
        if (cut_.isExact(out_.page)) {
            addTriangles();
        } else {
            visit(view_.header.root, {glm::dvec3(0), double(1u << view_.header.log2Cells)});
        }
        out_.error = std::max(certified + error_.added * cell, error_.ofMesh * cell);
        toWorld();
    }

private:
    [[nodiscard]] LatticePoint pointOf(uint32_t vertex) const {
        const LatticePoint local = LatticePoint(unpack21(view_.vertices[vertex])) - int64_t{kLatticeBias};
        return origin_ + local * (int64_t{1} << shift_);
    }

    /// Takes all triangles of an exact page: whole, where all corners have a home.
    void addTriangles() {
        const int64_t edge = cut_.edgeOf(out_.page);
        for (uint32_t v = 0; v < view_.vertices.size(); ++v) {
            const LatticePoint p = pointOf(v);
            const bool isInside = glm::all(glm::greaterThan(p, origin_)) && glm::all(glm::lessThan(p, origin_ + edge));
            out_.points.push_back(p);
            out_.homes.push_back(isInside ? out_.page : cut_.homeOf(p).value_or(kNoPage));
            if (!view_.vertexColours.empty()) out_.colours.push_back(view_.vertexColours[v]);
        }
        const PageDraft draft = draftOf(view_);
        for (const Index3& t : draft.triangles) {
            const bool isWhole = std::ranges::none_of(t, [&](uint32_t v) { return out_.homes[v] == kNoPage; });
            if (!isWhole) {
                addCutOff(t, {glm::dvec3(0), double(1u << view_.header.log2Cells)});
            } else if (cut_.wants(
                           cut_.worldOf(glm::dvec3(out_.points[t[0]] + out_.points[t[1]] + out_.points[t[2]]) / 3.0))) {
                out_.whole.push_back(t);
            }
        }
    }

    void visit(uint32_t node, const LeafBox& box) {
        const auto take = [&](const PolygonError& error) {
            error_.added = std::max(error_.added, error.added);
            error_.ofMesh = std::max(error_.ofMesh, error.ofMesh);
        };
        switch (nodeType(node)) {
            case kNodeInternal:
                for (uint32_t o = 0; o < 8; ++o)
                    visit(view_.nodes[8 * (node & kNodePayloadMask) + o],
                          {box.low + box.edge / 2 * glm::dvec3(o & 1u, o >> 1 & 1u, o >> 2 & 1u), box.edge / 2});
                return;
            case kNodeSoft:
                return take(addSoftLeaf(view_, node, box, out_.loose));
            case kNodeSlab:
                return take(addSlabLeaf(view_, node, box, out_.loose));
            case kNodeHard:
                return forEachTriangle(view_.strips, node, [&](const Index3& t) { addCutOff(t, box); });
            default:
                return;
        }
    }

    void addCutOff(const Index3& triangle, const LeafBox& box) {
        std::vector<ColouredPoint> corners;
        for (const uint32_t v : triangle) {
            ColouredPoint& p = corners.emplace_back();
            p.at = f64::decodeVertex(view_.vertices[v].x, view_.vertices[v].y);
            if (view_.vertexColours.empty()) continue;
            const uint32_t c = view_.vertexColours[v];
            p.colour = glm::dvec4(c & 255u, c >> 8 & 255u, c >> 16 & 255u, c >> 24);
        }
        out_.loose.addPolygon(clippedTo(box, std::move(corners)));
    }

    /// Brings the polygons from page space to the world, and leaves out what is not wanted.
    void toWorld() {
        const glm::dvec3 origin(origin_);
        const double steps = double(int64_t{kLatticePerCell} << shift_);
        for (ColouredPoint& p : out_.loose.points) p.at = cut_.worldOf(origin + p.at * steps);
        const auto& points = out_.loose.points;
        const size_t left = std::erase_if(out_.loose.triangles, [&](const Index3& t) {
            return !cut_.wants((points[t[0]].at + points[t[1]].at + points[t[2]].at) / 3.0);
        });
        if (left > 0) dropUnusedPoints(out_.loose);
    }

    const SurfaceCut& cut_;
    const PageView& view_;
    ExportedPage& out_;
    LatticePoint origin_;
    uint32_t shift_;
    PolygonError error_;
};

}  // namespace

Result<ExportedPage> readPageSurface(const ByteReader& reader, const SurfaceCut& cut, uint64_t page, bool withColour) {
    VCP_TRY_ASSIGN(const auto bytes, readPage(reader, cut.dataset(), page, withColour && cut.dataset().hasColour()));
    const PageView view = viewOfChecked(bytes.geometryBytes(), bytes.colourBytes());
    ExportedPage surface;
    surface.page = page;
    PageWalk(cut, view, surface).run();
    return surface;
}

}  // namespace vcp
