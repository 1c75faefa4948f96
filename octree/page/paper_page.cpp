#include "octree/page/paper_page.h"

#include <cmath>
#include <cstring>
#include <vector>

#include <fmt/format.h>

#include "octree/page/broken_page.h"

namespace vcp {

namespace {

constexpr uint32_t kMaxRoots = 64;  // roots along an axis
constexpr uint32_t kMaxLevel = 20;

Result<void> checkHeader(const PaperPageHeader& h, uint64_t bytes, uint32_t log2Cells) {
    if (h.magic != PaperPageHeader::kMagic) return brokenPage(0, "not a page of this method");
    if (h.cellShift > log2Cells)
        return brokenPage(offsetof(PaperPageHeader, cellShift), "size of the cells out of range");
    if (h.rootLevel < 1 || h.rootLevel > kMaxLevel || log2Cells > kMaxLevel)
        return brokenPage(4, "size of the roots out of range");
    uint64_t roots = 1;
    for (const uint32_t count : h.roots) {
        if (count < 1 || count > kMaxRoots || uint64_t{count} << h.rootLevel > uint64_t{1} << (log2Cells - h.cellShift))
            return brokenPage(16, "number of roots out of range");
        roots *= count;
    }
    if (h.packing > uint32_t(PaperPacking::Octahedral)) return brokenPage(8, "unknown packing");
    if (h.nodes < roots || (h.nodes - roots) % 8 != 0 || h.nodes > uint32_t{paper::kPaperEmpty})
        return brokenPage(12, "node count out of range");
    const auto isLength = [](float x) { return x > 0 && std::isfinite(x); };
    if (!isLength(h.cutoff) || !isLength(h.longest))
        return brokenPage(offsetof(PaperPageHeader, cutoff), "lengths are not numbers");
    for (size_t i = 0; i < std::size(h.reserved); ++i)
        if (h.reserved[i] != 0)
            return brokenPage(offsetof(PaperPageHeader, reserved) + 4 * i, "reserved bytes must be zero");
    if (paperSections(h).end != bytes)
        return brokenPage(12,
                          fmt::format("page counts ask for {} bytes, the page has {}", paperSections(h).end, bytes));
    return {};
}

/// Walks the nodes in order. A group of children may be named only once, by an earlier node; so the nodes form trees.
class PaperNodeCheck {
public:
    explicit PaperNodeCheck(const PaperPageView& page)
        : page_(page),
          roots_(page.header.roots[0] * page.header.roots[1] * page.header.roots[2]),
          level_((page.header.nodes - roots_) / 8, kNoLevel) {}

    Result<void> run() {
        for (uint32_t i = 0; i < page_.header.nodes; ++i) VCP_TRY(node(i));
        if (leaves_ != page_.header.leaves || empties_ != page_.header.emptyNodes)
            return brokenPage(offsetof(PaperPageHeader, leaves), "node counts do not match the nodes");
        return {};
    }

private:
    static constexpr uint8_t kNoLevel = 0xff;

    Result<void> node(uint32_t i) {
        const uint64_t byte = paper::kPaperHeaderBytes + uint64_t{4} * i;
        const uint8_t level = i < roots_ ? uint8_t(page_.header.rootLevel) : level_[(i - roots_) / 8];
        if (level == kNoLevel) return brokenPage(byte, "nodes without a parent");
        const int32_t word = page_.nodes[i];
        if (word < 0) {
            ++leaves_;
            if (uint64_t{uint32_t(-(word + 1))} + 1 >= page_.header.slices)
                return brokenPage(byte, "leaf out of range");
            return {};
        }
        if (word >= paper::kPaperEmpty) {
            ++empties_;
            return {};
        }
        const auto child = uint32_t(word);
        if (level == 0) return brokenPage(byte, "nodes are nested too deeply");
        if (child < roots_ || child <= i || child >= page_.header.nodes || (child - roots_) % 8 != 0 ||
            level_[(child - roots_) / 8] != kNoLevel)
            return brokenPage(byte, "node names wrong children");
        level_[(child - roots_) / 8] = uint8_t(level - 1);
        return {};
    }

    const PaperPageView& page_;
    uint32_t roots_;
    std::vector<uint8_t> level_;  // the level of each group
    uint32_t leaves_ = 0, empties_ = 0;
};

}  // namespace

PaperSections paperSections(const PaperPageHeader& h) {
    const uint64_t slices = (paper::kPaperHeaderBytes + uint64_t{4} * h.nodes + 15) & ~uint64_t{15};
    return {slices, slices + uint64_t{16} * h.slices};
}

Result<PaperPageView> parsePaperPage(std::span<const std::byte> bytes, uint32_t log2Cells) {
    if (bytes.size() < sizeof(PaperPageHeader)) return brokenPage(0, "page is shorter than its header");
    PaperPageView page;
    std::memcpy(&page.header, bytes.data(), sizeof(PaperPageHeader));
    VCP_TRY(checkHeader(page.header, bytes.size(), log2Cells));
    page.nodes = {reinterpret_cast<const int32_t*>(bytes.data() + sizeof(PaperPageHeader)), page.header.nodes};
    page.slices = {reinterpret_cast<const glm::u32vec4*>(bytes.data() + paperSections(page.header).slices),
                   page.header.slices};
    VCP_TRY(PaperNodeCheck(page).run());
    return page;
}

}  // namespace vcp
