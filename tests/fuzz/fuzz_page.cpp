// What must hold for every stored page, however hostile: it is refused, or decodes to the size that was asked for;
// and what then is a page can be stored and comes back as the same leaves.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "octree/page/page_codec.h"
#include "octree/page/paper_page.h"

namespace {

void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "broken: %s\n", what);
    std::abort();
}

/// Reads the same bytes as a colour page with places in images: refused, or it comes back.
void checkTextured(std::span<const std::byte> packed, std::span<const std::byte> bytes, const vcp::PageView& page) {
    std::vector<std::byte> textured(packed.begin(), packed.end());
    textured[0] = std::byte{3};
    const uint64_t size = vcp::texturedPageBytes(page.header);
    const auto colour = vcp::unpackColour(textured, size, page);
    if (!colour.ok() || page.header.vertices < 3) return;
    const auto colours = std::as_bytes(std::span(*colour));
    const vcp::PackedPage stored = vcp::packPage(bytes, colours);
    const auto again = vcp::unpackGeometry(stored.geometry, stored.geometryBytes);
    require(again.ok(), "a textured page can be stored");
    const auto view = vcp::parsePage(std::as_bytes(std::span(*again)));
    require(view.ok(), "a stored textured page comes back");
    const auto coloursAgain = vcp::unpackColour(stored.colour, size, *view);
    require(coloursAgain.ok(), "with its colours");
    const vcp::PackedPage twice =
        vcp::packPage(std::as_bytes(std::span(*again)), std::as_bytes(std::span(*coloursAgain)));
    require(twice.colour == stored.colour, "and places");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size < 4) return 0;
    uint32_t pageBytes = 0;
    std::memcpy(&pageBytes, data, 4);
    pageBytes %= 1u << 18;
    const auto packed = std::as_bytes(std::span(data + 4, size - 4));
    const auto block = vcp::unpackGeometry(packed, pageBytes);
    if (!block.ok()) return 0;
    const auto bytes = std::as_bytes(std::span(*block));
    require(bytes.size() == pageBytes / 16 * 16, "size of the page");
    static_cast<void>(vcp::parsePaperPage(bytes, 20));
    const auto page = vcp::parsePage(bytes);
    if (!page.ok()) return 0;
    const vcp::PackedPage packedAgain = vcp::packPage(bytes, {});
    const auto again = vcp::unpackGeometry(packedAgain.geometry, packedAgain.geometryBytes);
    require(again.ok(), "a page can be stored");
    const auto view = vcp::parsePage(std::as_bytes(std::span(*again)));
    require(view.ok(), "a stored page comes back");
    require(view->header.softLeaves == page->header.softLeaves && view->header.hardLeaves == page->header.hardLeaves &&
                view->header.slabLeaves == page->header.slabLeaves,
            "with its leaves");
    const vcp::PackedPage packedTwice = vcp::packPage(std::as_bytes(std::span(*again)), {});
    require(packedTwice.geometry == packedAgain.geometry, "and with all that is in them");
    static_cast<void>(vcp::unpackColour(packed, vcp::colourPageBytes(page->header), *page));
    checkTextured(packed, bytes, *page);
    return 0;
}
