#include "octree/page/page.h"

#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "octree/page/broken_page.h"

namespace vcp {

namespace {

constexpr uint64_t align16(uint64_t bytes) { return (bytes + 15) & ~uint64_t{15}; }

Result<void> checkHeader(const PageHeader& h, uint64_t bytes) {
    if (h.magic != PageHeader::kMagic) return brokenPage(0, "not a page");
    if (h.log2Cells < 1 || h.log2Cells > 7) return brokenPage(4, "page size out of range");
    if (h.faces > kLeafIndexMask || h.entries > kHardFirstMask + 1 || h.vertices > kField21Mask ||
        h.groups > (1u << 27))
        return brokenPage(12, "page counts out of range");
    if (h.slabLeaves > uint64_t{4} * h.faces)
        return brokenPage(offsetof(PageHeader, slabLeaves), "fewer vectors than slab leaves");
    if (!(h.certifiedError >= 0) || !std::isfinite(h.certifiedError))
        return brokenPage(offsetof(PageHeader, certifiedError), "certified error is not a number");
    for (size_t i = 0; i < std::size(h.reserved); ++i)
        if (h.reserved[i] != 0)
            return brokenPage(offsetof(PageHeader, reserved) + 4 * i, "reserved bytes must be zero");
    if (pageSections(h).end != bytes)
        return brokenPage(12, fmt::format("page counts ask for {} bytes, the page has {}", pageSections(h).end, bytes));
    return {};
}

/// Walks the node groups in order. Each group may be named only once, by an earlier group; so the nodes form a tree.
class NodeCheck {
public:
    explicit NodeCheck(const PageView& page)
        : page_(page),
          depth_(page.header.groups, 0xff),
          vectorTaken_(page.header.slabLeaves > 0 ? size_t{4} * page.header.faces : 0) {}

    Result<void> run() {
        const uint32_t maxDepth = page_.header.log2Cells + kMaxSubcellDepth;
        VCP_TRY(node(page_.header.root, -1, 0, maxDepth, 8));
        for (uint32_t g = 0; g < page_.header.groups; ++g) {
            const uint64_t byte = kPageHeaderBytes + uint64_t{32} * g;
            if (depth_[g] == 0xff) return brokenPage(byte, "node group without a parent");
            for (uint32_t i = 0; i < 8; ++i)
                VCP_TRY(node(page_.nodes[8 * g + i], g, depth_[g], maxDepth, byte + 4 * i));
        }
        if (soft_ != page_.header.softLeaves || hard_ != page_.header.hardLeaves || slabs_ != page_.header.slabLeaves)
            return brokenPage(28, "leaf counts do not match the nodes");
        return {};
    }

private:
    Result<void> node(uint32_t word, int64_t group, uint32_t depth, uint32_t maxDepth, uint64_t byte) {
        const uint32_t index = word & kLeafIndexMask;
        switch (nodeType(word)) {
            case kNodeInternal: {
                const uint32_t child = word & kNodePayloadMask;
                if (child >= page_.header.groups || int64_t{child} <= group || depth_[child] != 0xff)
                    return brokenPage(byte, "node names a wrong group of children");
                if (depth >= maxDepth) return brokenPage(byte, "nodes are nested too deeply");
                depth_[child] = uint8_t(depth + 1);
                return {};
            }
            case kNodeSoft:
                ++soft_;
                if (index + 1 >= page_.header.faces || (word >> kSoftAxisShift & 3u) > 2)
                    return brokenPage(byte, "soft leaf out of range");
                return {};
            case kNodeHard:
                ++hard_;
                return hardLeaf(word, byte);
            case kNodeSlab:
                return slabLeaf(word, byte);
            default:
                return {};
        }
    }

    Result<void> slabLeaf(uint32_t word, uint64_t byte) {
        ++slabs_;
        const uint32_t vector = slabVector(word);
        if (vector >= vectorTaken_.size()) return brokenPage(byte, "slab leaf out of range");
        if (slabOctants(word) == 0) return brokenPage(byte, "slab leaf has no octants");
        if (vectorTaken_[vector]) return brokenPage(byte, "slab leaf has another's vector");
        vectorTaken_[vector] = true;
        return {};
    }

    Result<void> hardLeaf(uint32_t word, uint64_t byte) {
        const uint32_t first = word & kHardFirstMask;
        if (first >= page_.header.entries) return brokenPage(byte, "hard leaf out of range");
        StripWalk walk(page_.strips, word);
        if (walk.count() == 0 || walk.count() > page_.header.entries - first)
            return brokenPage(byte, "hard leaf names too many triangles");
        while (walk.next())
            for (const uint32_t v : walk.triangle())
                if (v >= page_.header.vertices)
                    return brokenPage(
                        pageSections(page_.header).strips + uint64_t{entryBytes(page_.header.vertices)} * walk.entry(),
                        "triangle names a missing vertex");
        if (!walk.isWhole()) return brokenPage(byte, "strips of a hard leaf are broken");
        // Leaves share no entries, so a small page cannot ask for endless work, here or of a ray.
        named_ += walk.entry() + 1 - first;
        if (named_ > page_.header.entries) return brokenPage(byte, "hard leaves name too many triangles");
        return {};
    }

    const PageView& page_;
    std::vector<uint8_t> depth_;
    std::vector<bool> vectorTaken_;
    uint32_t soft_ = 0, hard_ = 0, slabs_ = 0;
    uint64_t named_ = 0;  ///< entries of all hard leaves so far
};

template <class T>
std::span<const T> section(std::span<const std::byte> bytes, uint64_t offset, uint64_t count) {
    return {reinterpret_cast<const T*>(bytes.data() + offset), count};
}

}  // namespace

PageSections pageSections(const PageHeader& h) {
    PageSections s{};
    s.nodes = kPageHeaderBytes;
    s.faces = s.nodes + uint64_t{32} * h.groups;
    s.vertices = s.faces + uint64_t{16} * h.faces;
    s.normals = align16(s.vertices + uint64_t{8} * h.vertices);
    s.strips = align16(s.normals + uint64_t{4} * h.vertices);
    s.end = align16(s.strips + uint64_t{entryBytes(h.vertices)} * h.entries);
    return s;
}

uint64_t colourPageBytes(const PageHeader& h) { return align16(uint64_t{16} * h.faces + uint64_t{4} * h.vertices); }

uint64_t texturedPageBytes(const PageHeader& h) {
    return uint64_t{16} * h.faces + uint64_t{4 + sizeof(TexturePoint)} * h.vertices;
}

PageView viewOfChecked(std::span<const std::byte> bytes, std::span<const std::byte> colours) {
    PageView page;
    std::memcpy(&page.header, bytes.data(), sizeof(PageHeader));
    const PageHeader& h = page.header;
    const PageSections s = pageSections(h);
    page.nodes = section<uint32_t>(bytes, s.nodes, uint64_t{8} * h.groups);
    page.faces = section<uint4>(bytes, s.faces, h.faces);
    page.vertices = section<glm::u32vec2>(bytes, s.vertices, h.vertices);
    page.normals = section<uint32_t>(bytes, s.normals, h.vertices);
    const uint32_t bytesEach = entryBytes(h.vertices);
    page.strips = {bytes.subspan(s.strips, size_t{bytesEach} * h.entries), bytesEach};
    if (!colours.empty()) {
        page.faceColours = section<uint4>(colours, 0, h.faces);
        page.vertexColours = section<uint32_t>(colours, uint64_t{16} * h.faces, h.vertices);
        // A triangle's page has three vertices at least, and then the sizes differ.
        if (colours.size() != colourPageBytes(h))
            page.points = section<TexturePoint>(colours, uint64_t{16} * h.faces + uint64_t{4} * h.vertices, h.vertices);
    }
    return page;
}

Result<PageView> parsePage(std::span<const std::byte> bytes, std::span<const std::byte> colours) {
    if (bytes.size() < kPageHeaderBytes) return brokenPage(0, "page is shorter than its header");
    PageHeader header;
    std::memcpy(&header, bytes.data(), sizeof(PageHeader));
    VCP_TRY(checkHeader(header, bytes.size()));
    if (!colours.empty() && colours.size() != colourPageBytes(header) && colours.size() != texturedPageBytes(header))
        return brokenPage(0, "colour page does not match its page");
    const PageView page = viewOfChecked(bytes, colours);
    VCP_TRY(NodeCheck(page).run());
    return page;
}

}  // namespace vcp
