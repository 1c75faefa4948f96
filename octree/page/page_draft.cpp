#include "octree/page/page_draft.h"

#include <algorithm>
#include <cstring>

#include "octree/surface/position_map.h"

namespace vcp {

namespace {

/// Calls `visit(word)` for the root and every node, in order.
template <class Page, class Visit>
void forEachWord(Page& page, Visit&& visit) {
    visit(page.header.root);
    for (auto& word : page.nodes) visit(word);
}

}  // namespace

bool PageDraft::hasMarks() const {
    bool isMarked = std::any_of(vertices.begin(), vertices.end(), isOpenVertex);
    forEachWord(*this, [&](uint32_t word) { isMarked |= nodeType(word) == kNodeSlab && isOpenSlab(word); });
    return isMarked;
}

std::vector<std::byte> pageOf(const PageDraft& draft) {
    struct {
        PageHeader header;
        std::vector<uint32_t> nodes;
    } page{draft.header, draft.nodes};
    std::vector<uint32_t> entries;
    std::vector<Index3> list;
    forEachWord(page, [&](uint32_t& word) {
        if (nodeType(word) != kNodeHard || entries.size() > kHardFirstMask) return;
        list.clear();
        for (const uint32_t t : draft.lists.of(draftList(word))) list.push_back(draft.triangles[t]);
        word = appendHardLeaf(list, entries);
    });
    page.header.entries = uint32_t(entries.size());
    const PageSections s = pageSections(page.header);
    std::vector<std::byte> bytes(s.end);
    std::memcpy(bytes.data(), &page.header, sizeof page.header);
    copyTo(bytes, s.nodes, page.nodes);
    copyTo(bytes, s.faces, draft.faces);
    copyTo(bytes, s.vertices, draft.vertices);
    copyTo(bytes, s.normals, draft.normals);
    storeEntries(entries, page.header.vertices, bytes.data() + s.strips);
    return bytes;
}

PageDraft draftOf(const PageView& page) {
    PageDraft draft;
    draft.header = page.header;
    draft.nodes.assign(page.nodes.begin(), page.nodes.end());
    draft.faces.assign(page.faces.begin(), page.faces.end());
    draft.vertices.assign(page.vertices.begin(), page.vertices.end());
    draft.normals.assign(page.normals.begin(), page.normals.end());
    PositionMap<uint32_t> numbers(page.strips.size() / 4);  // of triangles, plus 1
    forEachWord(draft, [&](uint32_t& word) {
        if (nodeType(word) != kNodeHard) return;
        forEachTriangle(page.strips, word, [&](Index3 t) {
            std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
            uint32_t& number = numbers.findOrAdd(uint64_t{t[0]} << 42 | uint64_t{t[1]} << 21 | t[2]);
            if (number == 0) {
                draft.triangles.push_back(t);
                number = uint32_t(draft.triangles.size());
            }
            draft.lists.triangles.push_back(number - 1);
        });
        word = draftLeaf(draft.lists.endList());
    });
    return draft;
}

}  // namespace vcp
