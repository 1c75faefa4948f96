#include "viewer/bench/peers/subvolume_caster.h"

#include <cmath>

#include "octree/dataset_reader.h"
#include "octree/page_reader.h"

namespace vcp {

namespace {

CornerOctree treeOf(const PaperPageView& page) {
    CornerOctree tree;
    tree.frame.rootLevel = int(page.header.rootLevel);
    for (int axis = 0; axis < 3; ++axis) tree.frame.roots[axis] = int(page.header.roots[axis]);
    tree.nodes.assign(page.nodes.begin(), page.nodes.end());
    for (const glm::u32vec4& slice : page.slices) tree.slices.push_back({slice.x, slice.y, slice.z, slice.w});
    tree.cutoff = page.header.cutoff;
    tree.largest = page.header.longest;
    return tree;
}

}  // namespace

Result<SubvolumeCaster> SubvolumeCaster::open(const std::filesystem::path& file, const PaperMarch& march) {
    VCP_TRY_ASSIGN(const auto reader, openFile(file));
    VCP_TRY_ASSIGN(const auto dataset, readDataset(*reader));
    const FileHeader& h = dataset.header;
    if (h.method != Method::Paper || h.levels < 2)
        return Error{.code = ErrorCode::Usage,
                     .message = "is no file of the paper's method in subvolumes",
                     .file = file.string()};
    SubvolumeCaster caster;
    caster.level_ = int(h.log2Cells);
    caster.march_ = march;
    Pages pages;
    std::unordered_map<uint64_t, size_t> numbers;
    for (uint64_t i = 0; i < dataset.pages.size(); ++i) {
        const PageEntry& entry = dataset.pages[i];
        if (entry.level > 0 && entry.level + 1u < h.levels) continue;
        VCP_TRY_ASSIGN(const auto bytes, readPage(*reader, dataset, i, false));
        VCP_TRY_ASSIGN(const auto view, parsePaperPage(bytes.geometryBytes(), h.log2Cells + h.levels - 1));
        if (entry.level > 0) numbers.emplace(entry.morton, pages.size());
        pages.push_back({treeOf(view), PaperDecoder(view.header.longest, PaperPacking(view.header.packing)),
                         glm::ivec3(mortonDecode(entry.morton)) * (1 << h.log2Cells), int(view.header.cellShift)});
    }
    caster.frame_ = pages.front().tree.frame;
    caster.frame_.rootLevel += pages.front().shift;
    caster.frame_.cell = h.cell;
    glm::dvec3 size;
    for (int axis = 0; axis < 3; ++axis) {
        caster.frame_.low[axis] = h.origin[axis];
        size[axis] = (h.boundsMax[axis] - h.boundsMin[axis]) / h.cell;
    }
    caster.extent_ = glm::length(size);
    caster.pages_ = std::make_shared<const Pages>(std::move(pages));
    caster.numbers_ = std::make_shared<const std::unordered_map<uint64_t, size_t>>(std::move(numbers));
    return caster;
}

uint64_t SubvolumeCaster::bytes() const {
    uint64_t bytes = 0;
    for (const Page& page : *pages_) bytes += page.tree.bytes();
    return bytes;
}

const SubvolumeCaster::Page& SubvolumeCaster::pageAt(glm::ivec3 subvolume, glm::vec3 eye) const {
    const auto edge = float(1 << level_);
    const glm::vec3 low = glm::vec3(subvolume) * edge;
    const float distance = glm::distance(glm::clamp(eye, low, low + edge), eye);
    if (double(distance) >= double(march_.reach) * extent_) return pages_->front();
    const auto found = numbers_->find(mortonEncode(glm::u32vec3(subvolume)));
    return found != numbers_->end() ? (*pages_)[found->second] : pages_->front();
}

}  // namespace vcp
