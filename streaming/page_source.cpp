#include "streaming/page_source.h"

#include <algorithm>
#include <cstring>

#include "octree/image_needs.h"

namespace vcp {

namespace {

// Pages stand on 256 bytes; a gap of this size, such as colour that is not wanted, is read and thrown away.
constexpr uint64_t kLargestGap = 4096;

struct Extent {
    uint64_t begin = 0, end = 0;
};

/// Returns where a page's stored bytes are; geometry and colour follow each other.
Extent extentOf(const PageEntry& page, bool withColour) {
    const bool colour = withColour && page.colourStoredBytes != 0;
    return {page.offset, colour ? page.colourOffset + page.colourStoredBytes : page.offset + page.storedBytes};
}

/// A stretch of a file that is in memory already.
class Stretch final : public ByteReader {
public:
    Stretch(const ByteReader& file, uint64_t begin, std::span<const std::byte> bytes)
        : file_(file), begin_(begin), bytes_(bytes) {}
    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override {
        if (offset < begin_ || bytes.size() > bytes_.size() || offset - begin_ > bytes_.size() - bytes.size())
            return file_.read(offset, bytes);
        std::memcpy(bytes.data(), bytes_.data() + (offset - begin_), bytes.size());
        return {};
    }
    [[nodiscard]] uint64_t size() const override { return file_.size(); }
    [[nodiscard]] const std::string& name() const override { return file_.name(); }

private:
    const ByteReader& file_;
    uint64_t begin_;
    std::span<const std::byte> bytes_;
};

}  // namespace

std::vector<Result<PageBytes>> PageSource::readRun(Request first, uint32_t count, bool withColour) const {
    std::vector<Result<PageBytes>> run;
    for (uint32_t i = 0; i < count; ++i) run.push_back(read(first.after(i), withColour));
    return run;
}

uint32_t PageSource::runFrom(Request, uint32_t, bool) const { return 1; }

Result<PageBytes> FilePageSource::read(Request request, bool withColour) const {
    return std::move(readRun(request, 1, withColour).front());
}

Result<PageBytes> FilePageSource::readFrom(const ByteReader& bytes, uint64_t page, bool withColour) const {
    auto read = readPage(bytes, *dataset_, page, withColour);
    if (!read && read.error().code == ErrorCode::InvalidInput) {
        const Extent extent = extentOf(dataset_->pages[page], withColour);
        reader_->distrust(extent.begin, extent.end - extent.begin);
    }
    if (const auto images = knownImages(); read && images && !read->colour.empty())
        read->needs = imageNeeds(images->tables(), viewOfChecked(read->geometryBytes(), read->colourBytes()));
    return read;
}

std::vector<Result<PageBytes>> FilePageSource::readBlocks(uint64_t first, uint32_t count) const {
    std::vector<std::byte> stored(count * kBlockBytes);
    if (const auto got = reader_->read(blockOffset(first), stored); !got)
        return std::vector<Result<PageBytes>>(count, got.error());
    std::vector<Result<PageBytes>> blocks;
    for (uint64_t i = 0; i < count; ++i) {
        const auto admitted =
            admitBlock(*dataset_, reader_->name(), first + i, std::span(stored).subspan(i * kBlockBytes, kBlockBytes));
        if (!admitted) reader_->distrust(blockOffset(first + i), kBlockBytes);
        blocks.push_back(admitted ? Result<PageBytes>(PageBytes{}) : admitted.error());
    }
    return blocks;
}

std::vector<Result<PageBytes>> FilePageSource::readRun(Request first, uint32_t count, bool withColour) const {
    if (first.isPage()) return readPages(first.number, count, withColour);
    if (first.kind == Request::Kind::DirectoryBlock) return readBlocks(first.number, count);
    return readPieces(first.number, count);
}

std::vector<Result<PageBytes>> FilePageSource::readPages(uint64_t first, uint32_t count, bool withColour) const {
    std::vector<StoredPages::Bytes> kept;
    for (uint64_t page = first; page < first + count; ++page) kept.push_back(kept_.find(page));
    const auto extent = [&](uint32_t i) { return extentOf(dataset_->pages[first + i], withColour); };
    // One read covers all from the first page that is not kept to the last.
    uint32_t from = 0, to = count;
    while (from < to && kept[from]) ++from;
    while (to > from && kept[to - 1]) --to;
    const uint64_t begin = from < to ? extent(from).begin : 0, end = from < to ? extent(to - 1).end : 0;
    std::vector<std::byte> stored(end - begin);
    const Result<void> got = from < to ? reader_->read(begin, stored) : Result<void>();
    std::vector<Result<PageBytes>> pages;
    for (uint32_t i = 0; i < count; ++i) {
        if (!kept[i] && !got) {
            pages.push_back(got.error());
            continue;
        }
        const auto bytes = kept[i] ? std::span(*kept[i])
                                   : std::span<const std::byte>(stored).subspan(extent(i).begin - begin,
                                                                                extent(i).end - extent(i).begin);
        pages.push_back(readFrom(Stretch(*reader_, extent(i).begin, bytes), first + i, withColour));
        if (!kept[i] && pages.back()) kept_.keep(first + i, {bytes.begin(), bytes.end()});
    }
    return pages;
}

uint32_t FilePageSource::runFrom(Request first, uint32_t most, bool withColour) const {
    if (first.isPage()) return pageRunFrom(first.number, most, withColour);
    if (first.kind == Request::Kind::ImagePiece) return pieceRunFrom(first.number, most);
    return uint32_t(std::min<uint64_t>(most, dataset_->pages.blocks() - first.number));
}

uint32_t FilePageSource::pageRunFrom(uint64_t first, uint32_t most, bool withColour) const {
    uint32_t count = 1;
    const Extent start = extentOf(dataset_->pages[first], withColour);
    for (uint64_t last = start.end;
         count < most && first + count < dataset_->pages.size() && dataset_->pages.knows(first + count); ++count) {
        const Extent next = extentOf(dataset_->pages[first + count], withColour);
        if (next.begin > last + kLargestGap || next.end - start.begin > runBytes_) break;
        last = next.end;
    }
    return count;
}

Result<std::shared_ptr<const ImagePieces>> FilePageSource::images() const {
    if (auto known = knownImages(); known || !dataset_->hasImages()) return known;
    VCP_TRY_ASSIGN(auto read, ImagePieces::read(*reader_, dataset_->header.images));
    const std::lock_guard lock(mutex_);
    if (!images_) images_ = std::move(read);
    return images_;
}

std::shared_ptr<const ImagePieces> FilePageSource::knownImages() const {
    const std::lock_guard lock(mutex_);
    return images_;
}

uint32_t FilePageSource::pieceRunFrom(uint64_t first, uint32_t most) const {
    const auto images = knownImages();
    const uint64_t begin = images->extentOf(images->piece(first)).begin;
    uint32_t count = 1;
    while (count < most && first + count < images->count() &&
           images->extentOf(images->piece(first + count)).end - begin <= runBytes_)
        ++count;
    return count;
}

std::vector<Result<PageBytes>> FilePageSource::readPieces(uint64_t first, uint32_t count) const {
    const auto images = knownImages();
    const auto extent = [&](uint32_t i) { return images->extentOf(images->piece(first + i)); };
    const uint64_t begin = extent(0).begin;
    std::vector<std::byte> stored(extent(count - 1).end - begin);
    if (const auto got = reader_->read(begin, stored); !got) return std::vector<Result<PageBytes>>(count, got.error());
    std::vector<Result<PageBytes>> pieces;
    for (uint32_t i = 0; i < count; ++i) {
        auto texels = images->readPiece(Stretch(*reader_, begin, stored), first + i);
        if (!texels) {
            reader_->distrust(extent(i).begin, extent(i).bytes());
            pieces.emplace_back(texels.error());
            continue;
        }
        PageBytes piece;
        piece.texels = *std::move(texels);
        pieces.emplace_back(std::move(piece));
    }
    return pieces;
}

uint64_t FilePageSource::bytesToRead(Request request, bool withColour) const {
    if (request.kind == Request::Kind::DirectoryBlock) return kBlockBytes;
    if (request.kind == Request::Kind::ImagePiece) {
        const auto images = knownImages();
        const ImagePiece piece = images->piece(request.number);
        return 2 * images->extentOf(piece).bytes() + images->texelsOf(piece) * sizeof(uint32_t);
    }
    const PageEntry& entry = dataset_->pages[request.number];
    const uint64_t geometry = 2 * uint64_t{entry.storedBytes} + entry.pageBytes;
    return withColour ? geometry + 2 * uint64_t{entry.colourStoredBytes} + entry.colourBytes : geometry;
}

}  // namespace vcp
