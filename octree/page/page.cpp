#include "octree/page/page.h"

#include <cmath>
#include <cstring>

#include <fmt/format.h>

namespace vcp {

namespace {

constexpr uint64_t align16(uint64_t bytes) { return (bytes + 15) & ~uint64_t{15}; }

Error broken(uint64_t byte, std::string what) {
    return {.code = ErrorCode::InvalidInput, .message = std::move(what), .element = "page", .byte = byte};
}

Result<void> checkHeader(const PageHeader& h, uint64_t bytes) {
    if (h.magic != PageHeader::kMagic) return broken(0, "not a page");
    if (h.log2Cells < 1 || h.log2Cells > 7) return broken(4, "page size out of range");
    if (h.faces > kLeafIndexMask || h.triangles > kLeafIndexMask || h.vertices > kField21Mask || h.groups > (1u << 27))
        return broken(12, "page counts out of range");
    if (!(h.certifiedError >= 0) || !std::isfinite(h.certifiedError))
        return broken(offsetof(PageHeader, certifiedError), "certified error is not a number");
    for (size_t i = 0; i < std::size(h.reserved); ++i)
        if (h.reserved[i] != 0) return broken(offsetof(PageHeader, reserved) + 4 * i, "reserved bytes must be zero");
    if (pageSections(h).end != bytes)
        return broken(12, fmt::format("page counts ask for {} bytes, the page has {}", pageSections(h).end, bytes));
    return {};
}

/// Walks the node groups in order. Each group may be named only once, by an earlier group; so the nodes form a tree.
class NodeCheck {
public:
    explicit NodeCheck(const PageView& page) : page_(page), depth_(page.header.groups, 0xff) {}

    Result<void> run() {
        const uint32_t maxDepth = page_.header.log2Cells + kMaxSubcellDepth;
        VCP_TRY(node(page_.header.root, -1, 0, maxDepth, 8));
        for (uint32_t g = 0; g < page_.header.groups; ++g) {
            const uint64_t byte = kPageHeaderBytes + uint64_t{32} * g;
            if (depth_[g] == 0xff) return broken(byte, "node group without a parent");
            for (uint32_t i = 0; i < 8; ++i)
                VCP_TRY(node(page_.nodes[8 * g + i], g, depth_[g], maxDepth, byte + 4 * i));
        }
        if (soft_ != page_.header.softLeaves || hard_ != page_.header.hardLeaves)
            return broken(28, "leaf counts do not match the nodes");
        return {};
    }

private:
    Result<void> node(uint32_t word, int64_t group, uint32_t depth, uint32_t maxDepth, uint64_t byte) {
        const uint32_t index = word & kLeafIndexMask;
        switch (nodeType(word)) {
            case kNodeInternal: {
                const uint32_t child = word & kNodePayloadMask;
                if (child >= page_.header.groups || int64_t{child} <= group || depth_[child] != 0xff)
                    return broken(byte, "node names a wrong group of children");
                if (depth >= maxDepth) return broken(byte, "nodes are nested too deeply");
                depth_[child] = uint8_t(depth + 1);
                return {};
            }
            case kNodeSoft:
                ++soft_;
                if (index + 1 >= page_.header.faces || (word >> kSoftAxisShift & 3u) > 2)
                    return broken(byte, "soft leaf out of range");
                return {};
            case kNodeHard: {
                ++hard_;
                if (index >= page_.header.triangles) return broken(byte, "hard leaf out of range");
                const TriangleRange range = hardLeafTriangles(page_, word);
                if (range.count == 0 || range.count > page_.header.triangles - range.first)
                    return broken(byte, "hard leaf names too many triangles");
                // Leaves share no records, so a small page cannot ask for endless work, here or of a ray.
                named_ += range.count;
                if (named_ > page_.header.triangles) return broken(byte, "hard leaves name too many triangles");
                for (uint32_t t = range.first; t < range.first + range.count; ++t) VCP_TRY(triangle(t));
                return {};
            }
            default:
                return {};
        }
    }

    Result<void> triangle(uint32_t t) const {
        const glm::u32vec2 r = page_.triangles[t];
        if (f64::decodeIndex0(r.x) >= page_.header.vertices || f64::decodeIndex1(r.x, r.y) >= page_.header.vertices ||
            f64::decodeIndex2(r.y) >= page_.header.vertices)
            return broken(pageSections(page_.header).triangles + uint64_t{8} * t, "triangle names a missing vertex");
        return {};
    }

    const PageView& page_;
    std::vector<uint8_t> depth_;
    uint32_t soft_ = 0, hard_ = 0;
    uint64_t named_ = 0;  ///< triangle records of all hard leaves so far
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
    s.triangles = s.faces + uint64_t{16} * h.faces;
    s.vertices = align16(s.triangles + uint64_t{8} * h.triangles);
    s.normals = align16(s.vertices + uint64_t{8} * h.vertices);
    s.end = align16(s.normals + uint64_t{4} * h.vertices);
    return s;
}

uint64_t colourPageBytes(const PageHeader& h) { return align16(uint64_t{16} * h.faces + uint64_t{4} * h.vertices); }

TriangleRange hardLeafTriangles(const PageView& page, uint32_t node) {
    const uint32_t first = node & kLeafIndexMask;
    const uint32_t count = node >> kHardCountShift & kHardCountMask;
    if (count != kHardCountLong) return {first, count};
    return {first + 1, page.triangles[first].x};
}

Result<PageView> parsePage(std::span<const std::byte> bytes, std::span<const std::byte> colours) {
    if (bytes.size() < kPageHeaderBytes) return broken(0, "page is shorter than its header");
    PageView page;
    std::memcpy(&page.header, bytes.data(), sizeof(PageHeader));
    const PageHeader& h = page.header;
    VCP_TRY(checkHeader(h, bytes.size()));
    const PageSections s = pageSections(h);
    page.nodes = section<uint32_t>(bytes, s.nodes, uint64_t{8} * h.groups);
    page.faces = section<uint4>(bytes, s.faces, h.faces);
    page.triangles = section<glm::u32vec2>(bytes, s.triangles, h.triangles);
    page.vertices = section<glm::u32vec2>(bytes, s.vertices, h.vertices);
    page.normals = section<uint32_t>(bytes, s.normals, h.vertices);
    if (!colours.empty()) {
        if (colours.size() != colourPageBytes(h)) return broken(0, "colour page does not match its page");
        page.faceColours = section<uint4>(colours, 0, h.faces);
        page.vertexColours = section<uint32_t>(colours, uint64_t{16} * h.faces, h.vertices);
    }
    VCP_TRY(NodeCheck(page).run());
    return page;
}

}  // namespace vcp
