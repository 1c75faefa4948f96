#include "viewer/export/surface_cut.h"

#include <algorithm>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "octree/reference_caster.h"
#include "octree/surface/morton.h"

namespace vcp {

namespace {

// No edge of a triangle in a page is longer than so many of its cells (kMaxEdgeSteps in leaf_triangles.h).
constexpr double kMostEdgeCells = 256;

}  // namespace

Box boundsOf(const FileHeader& h) {
    return {{h.boundsMin[0], h.boundsMin[1], h.boundsMin[2]}, {h.boundsMax[0], h.boundsMax[1], h.boundsMax[2]}};
}

Result<SurfaceCut> SurfaceCut::create(const Dataset& dataset, const std::string& name, uint32_t level,
                                      const std::optional<Box>& box, const std::optional<CutPlane>& plane) {
    if (dataset.header.method != Method::Certified)
        return Error{.code = ErrorCode::Unsupported,
                     .message = "was built by the paper's method and has no certified surface; build it by the other",
                     .file = name};
    SurfaceCut cut(dataset);
    const FileHeader& header = dataset.header;
    cut.name_ = name;
    cut.level_ = std::min(level, header.levels - 1);
    cut.box_ = box;
    cut.step_ = header.cell / kLatticePerCell;
    cut.origin_ = {header.origin[0], header.origin[1], header.origin[2]};
    for (const uint64_t page : cutAtLevel(dataset, cut.level_)) {
        const PageEntry& entry = dataset.pages[page];
        if (entry.leaves == 0 || !cut.isWanted(entry, plane)) continue;
        cut.pages_.push_back(page);
        cut.isMesh_ = cut.isMesh_ && entry.childMask == 0 && cut.isExact(page);
        cut.certifiedError_ = std::max(cut.certifiedError_, double(entry.certifiedError));
    }
    return cut;
}

bool SurfaceCut::isInCut(const PageEntry& page) const { return page.level == level_ || page.childMask == 0; }

bool SurfaceCut::isWanted(const PageEntry& page, const std::optional<CutPlane>& plane) const {
    const double edge = dataset_->edgeOf(page);
    const glm::dvec3 low = dataset_->originOf(page), high = low + edge;
    // A triangle whose centre is in the box may have its corners' homes so far from it.
    const double reach = kMostEdgeCells * dataset_->cellOf(page.level);
    if (box_ &&
        (glm::any(glm::greaterThan(low - reach, box_->high)) || glm::any(glm::lessThan(high + reach, box_->low))))
        return false;
    if (!plane) return true;
    const double middle = glm::dot(plane->normal, (low + high) / 2.0) - plane->offset;
    const double span = glm::dot(glm::abs(plane->normal), glm::dvec3(edge / 2));
    return std::abs(middle) <= span * (1 + 1e-9) + 1e-12 * std::abs(plane->offset);
}

bool SurfaceCut::isExact(uint64_t page) const {
    const PageEntry& entry = dataset_->pages[page];
    return entry.leaves > 0 && entry.hardLeaves == entry.leaves;
}

uint32_t SurfaceCut::shiftOf(uint64_t page) const { return dataset_->header.levels - 1 - dataset_->pages[page].level; }

int64_t SurfaceCut::edgeOf(uint64_t page) const {
    return int64_t{kLatticePerCell} << (dataset_->header.log2Cells + shiftOf(page));
}

LatticePoint SurfaceCut::originOf(uint64_t page) const {
    return LatticePoint(mortonDecode(dataset_->pages[page].morton)) * edgeOf(page);
}

std::optional<uint64_t> SurfaceCut::homeOf(LatticePoint p) const { return homeBelow(0, p); }

std::optional<uint64_t> SurfaceCut::homeBelow(uint64_t page, LatticePoint p) const {
    const LatticePoint low = originOf(page), high = low + edgeOf(page);
    if (glm::any(glm::lessThan(p, low)) || glm::any(glm::greaterThan(p, high))) return {};
    const PageEntry& entry = dataset_->pages[page];
    if (isInCut(entry)) return isExact(page) ? std::optional(page) : std::nullopt;
    for (const uint64_t child : childrenOf(entry))
        if (const auto home = homeBelow(child, p)) return home;
    return {};
}

bool SurfaceCut::wants(glm::dvec3 centre) const {
    return !box_ || (glm::all(glm::greaterThanEqual(centre, box_->low)) && glm::all(glm::lessThan(centre, box_->high)));
}

Result<uint32_t> coarsestLevelWithin(double error, const Dataset& dataset, const std::string& name,
                                     const std::optional<Box>& box, const std::optional<CutPlane>& plane) {
    double last = 0;
    for (uint32_t level = 0; level < dataset.header.levels; ++level) {
        VCP_TRY_ASSIGN(const auto cut, SurfaceCut::create(dataset, name, level, box, plane));
        last = cut.certifiedError();
        if (last <= error) return level;
    }
    return Error{.code = ErrorCode::Usage,
                 .message = fmt::format("is certified within {:.4g} at its finest level, which is more than {:.4g}",
                                        last, error),
                 .file = name};
}

}  // namespace vcp
