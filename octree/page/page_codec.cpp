#include "octree/page/page_codec.h"

#include <algorithm>
#include <memory>
#include <optional>

#include <zstd.h>

#include "octree/page/codec_page.h"
#include "octree/page/colour_codec.h"
#include "octree/page/face_codec.h"
#include "octree/page/mesh_codec.h"
#include "octree/page/node_codec.h"
#include "octree/page/point_codec.h"
#include "octree/page/slab_codec.h"

namespace vcp {

namespace {

constexpr std::byte kPlain{0}, kCoded{1}, kMarked{2}, kTextured{3};
constexpr int kPlainLevel = 3;

Error broken(std::string message) { return {.code = ErrorCode::InvalidInput, .message = std::move(message)}; }

std::vector<std::byte> plain(std::span<const std::byte> bytes) {
    std::vector<std::byte> out(1 + ZSTD_compressBound(bytes.size()), kPlain);
    const size_t size = ZSTD_compress(out.data() + 1, out.size() - 1, bytes.data(), bytes.size(), kPlainLevel);
    out.resize(1 + (ZSTD_isError(size) ? 0 : size));  // cannot fail with room for compressBound
    return out;
}

Result<std::vector<uint4>> unpackPlain(std::span<const std::byte> packed, uint64_t bytes) {
    if (bytes % 16 != 0 || ZSTD_getFrameContentSize(packed.data(), packed.size()) != bytes)
        return broken("page does not decode to its size");
    std::vector<uint4> out(bytes / 16);
    if (ZSTD_decompress(out.data(), bytes, packed.data(), packed.size()) != bytes)
        return broken("page does not decode to its size");
    return out;
}

std::vector<std::byte> coded(RangeEncoder& coder, std::byte form = kCoded) {
    std::vector<std::byte> out{form};
    coder.finish(out);
    return out;
}

template <class Coder>
void codeHeader(Coder& coder, PageHeader& header) {
    NumberModel model;
    for (uint32_t* field :
         {&header.log2Cells, &header.groups, &header.faces, &header.vertices, &header.softLeaves, &header.hardLeaves})
        model.code(coder, *field);
    uint32_t error = std::bit_cast<uint32_t>(header.certifiedError), low = error & 0xffffu, high = error >> 16;
    coder.raw(low, 16);
    coder.raw(high, 16);
    header.certifiedError = std::bit_cast<float>(low | high << 16);
}

/// Checks the counts of a header without entries, before anything is allocated by them.
bool plausible(const PageHeader& h, uint64_t pageBytes) {
    return h.log2Cells >= 1 && h.log2Cells <= 7 && h.groups <= 1u << 27 && h.faces <= kLeafIndexMask &&
           h.vertices <= kField21Mask && h.softLeaves <= h.faces && h.hardLeaves <= 8 * h.groups + 1 &&
           pageSections(h).end <= pageBytes;
}

template <class Coder>
void codePage(Coder& coder, CodecPage& page) {
    // The models take some tens of kilobytes, too much for the stack of a small thread.
    std::make_unique<NodeCodec<Coder>>(coder, page)->run();
    if (!page.wrong) std::make_unique<FaceCodec<Coder>>(coder, page)->run();
    if (!page.wrong) std::make_unique<SlabCodec<Coder>>(coder, page)->run();
    if (!page.wrong) std::make_unique<MeshCodec<Coder>>(coder, page)->run();
    if (!page.wrong) page.finish();
}

/// The points in a colour page that has them.
std::span<TexturePoint> pointsIn(std::span<uint4> block, const PageHeader& header) {
    auto* vertices = reinterpret_cast<uint32_t*>(block.data() + header.faces);
    return {reinterpret_cast<TexturePoint*>(vertices + header.vertices), header.vertices};
}

/// Returns the colour page of a page in canonical order.
std::vector<uint4> inOrder(std::span<const std::byte> colour, const CodecPage& page) {
    std::vector<uint4> block(colour.size() / 16);
    const size_t faces = page.header.faces;
    const auto* oldFaces = reinterpret_cast<const uint4*>(colour.data());
    const auto* oldVertices = reinterpret_cast<const uint32_t*>(oldFaces + faces);
    auto* vertices = reinterpret_cast<uint32_t*>(block.data() + faces);
    for (size_t i = 0; i < page.faceSource.size(); ++i) block[i] = oldFaces[page.faceSource[i]];
    auto* slabs = reinterpret_cast<uint32_t*>(block.data() + page.softFaces());
    for (size_t i = 0; i < page.vectorSource.size(); ++i)
        slabs[i] = vectorWord({oldFaces, faces}, page.vectorSource[i]);
    for (size_t i = 0; i < page.vertexSource.size(); ++i) vertices[i] = oldVertices[page.vertexSource[i]];
    if (colour.size() == colourPageBytes(page.header)) return block;
    const auto* oldPoints = reinterpret_cast<const TexturePoint*>(oldVertices + page.header.vertices);
    const std::span<TexturePoint> points = pointsIn(block, page.header);
    for (size_t i = 0; i < page.vertexSource.size(); ++i) points[i] = oldPoints[page.vertexSource[i]];
    return block;
}

/// Codes a colour page, or reads it into `block`. Returns false when some of it has no place in the page.
template <class Coder>
bool codeColour(Coder& coder, const PageView& page, std::span<uint4> block) {
    const std::span vertices(reinterpret_cast<uint32_t*>(block.data() + page.header.faces), page.header.vertices);
    const bool all = std::make_unique<ColourCodec<Coder>>(coder, page, block.first(page.header.faces), vertices)->run();
    if (!all || block.size_bytes() == colourPageBytes(page.header)) return all;
    return std::make_unique<PointCodec<Coder>>(coder, page, pointsIn(block, page.header))->run();
}

}  // namespace

namespace {

PackedPage plainPage(std::span<const std::byte> geometry, std::span<const std::byte> colour) {
    return {plain(geometry), colour.empty() ? std::vector<std::byte>{} : plain(colour), geometry.size()};
}

/// Returns the coded page, or nothing where only the plain form holds it.
std::optional<PackedPage> codedPage(const PageDraft& draft, std::span<const std::byte> colour) {
    CodecPage page;
    page.header = draft.header;
    page.header.entries = 0;
    page.source = &draft;
    page.hasMarks = draft.hasMarks();
    // Whatever the strips will take, it is what the page is to be.
    if (!plausible(page.header, pageSections(page.header).end)) return {};
    page.allocate();
    RangeEncoder coder;
    codeHeader(coder, page.header);
    codePage(coder, page);
    if (page.wrong) return {};
    const auto view = parsePage(std::as_bytes(std::span(page.block)));
    if (!view) return {};
    PackedPage packed{coded(coder, page.hasMarks ? kMarked : kCoded), {}, page.block.size() * sizeof(uint4)};
    if (colour.empty()) return packed;
    std::vector<uint4> block = inOrder(colour, page);
    RangeEncoder colourCoder;
    if (!codeColour(colourCoder, *view, block)) return {};
    const bool isTextured = colour.size() != colourPageBytes(page.header);
    packed.colour = coded(colourCoder, isTextured ? kTextured : kCoded);
    return packed;
}

}  // namespace

Result<PackedPage> packPage(const PageDraft& draft, std::span<const std::byte> colour) {
    if (auto packed = codedPage(draft, colour)) return *std::move(packed);
    const std::vector<std::byte> page = pageOf(draft);
    VCP_TRY_ASSIGN(const auto whole, parsePage(page, colour));
    static_cast<void>(whole);
    return plainPage(page, colour);
}

PackedPage packPage(std::span<const std::byte> geometry, std::span<const std::byte> colour) {
    if (const auto page = parsePage(geometry))
        if (auto packed = codedPage(draftOf(*page), colour)) return *std::move(packed);
    return plainPage(geometry, colour);
}

Result<std::vector<uint4>> unpackGeometry(std::span<const std::byte> packed, uint64_t pageBytes) {
    if (packed.empty()) return broken("page does not decode: it is empty");
    if (packed[0] == kPlain) return unpackPlain(packed.subspan(1), pageBytes);
    if (packed[0] != kCoded && packed[0] != kMarked) return broken("page does not decode: unknown form");
    RangeDecoder coder(packed.subspan(1));
    CodecPage page;
    page.hasMarks = packed[0] == kMarked;
    codeHeader(coder, page.header);
    if (!plausible(page.header, pageBytes)) return broken("page does not decode to its size");
    page.mostEntries = uint32_t(std::min<uint64_t>(
        kHardFirstMask, (pageBytes - pageSections(page.header).strips) / entryBytes(page.header.vertices)));
    page.allocate();
    codePage(coder, page);
    if (page.wrong || !coder.complete() || page.block.size() * sizeof(uint4) != pageBytes)
        return broken("page does not decode to its size");
    return std::move(page.block);
}

Result<std::vector<uint4>> unpackColour(std::span<const std::byte> packed, uint64_t colourBytes, const PageView& page) {
    if (packed.empty()) return broken("colour page does not decode: it is empty");
    if (packed[0] == kPlain) return unpackPlain(packed.subspan(1), colourBytes);
    if (packed[0] != kCoded && packed[0] != kTextured) return broken("colour page does not decode: unknown form");
    if ((packed[0] == kCoded ? colourPageBytes(page.header) : texturedPageBytes(page.header)) != colourBytes)
        return broken("colour page does not decode to its size");
    std::vector<uint4> block(colourBytes / 16);
    RangeDecoder coder(packed.subspan(1));
    const bool all = codeColour(coder, page, block);
    if (!all || !coder.complete()) return broken("colour page does not decode to its size");
    return block;
}

}  // namespace vcp
