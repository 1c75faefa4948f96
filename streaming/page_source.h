// Where pages come from: a file, a server or a test.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "octree/image/image_pieces.h"
#include "octree/page_reader.h"
#include "streaming/request.h"
#include "streaming/stored_pages.h"

namespace vcp {

/// Where a page or block is, as messages name it.
struct PageOrigin {
    std::string file;  ///< empty where there is none
    Request request;   ///< in that file
};

/// Delivers checked pages, and takes in blocks of the directory. Any thread may call, several at once. Entries of pages
/// that are asked for are known.
class PageSource {
public:
    virtual ~PageSource() = default;
    /// Returns a page's bytes, verified, decompressed and parsed without complaint (readPage). Colour is empty where
    /// the dataset has none or it is not asked for. A block of the directory has no bytes, but its entries are known
    /// then. A piece of images has its texels.
    virtual Result<PageBytes> read(Request request, bool withColour) const = 0;

    /// `first` and what follows it, `count` in all, as read() would give each; where they lie together, in one read.
    virtual std::vector<Result<PageBytes>> readRun(Request first, uint32_t count, bool withColour) const;
    /// How many pages or blocks from `first` on are best read together, at most `most`; at least 1.
    [[nodiscard]] virtual uint32_t runFrom(Request first, uint32_t most, bool withColour) const;

    /// Memory that reading a page takes: its stored bytes, twice, and what it returns. Of a block: its bytes; of a
    /// piece of images: its stored ones and what it returns.
    [[nodiscard]] virtual uint64_t bytesToRead(Request request, bool withColour) const = 0;
    /// Allows the source to keep stored pages in memory, to be read again: from now on at most `bytes`, whatever is
    /// being read. Returns how many bytes are kept. Only the PageLoader that owns the memory calls it.
    virtual uint64_t keepWithin([[maybe_unused]] uint64_t bytes) const { return 0; }
    /// The part of the source that holds it, of those that are read from independently: 0, 1, …
    [[nodiscard]] virtual uint32_t partOf([[maybe_unused]] Request request) const { return 0; }
    /// Ends reads that are under way soon, with Cancelled, where they could take long. Later reads work.
    virtual void interrupt() const {}
    /// Returns the images of the pages' file, whose pieces may be asked for then; null where it has none. The first
    /// call reads their tables. Errors: ImagePieces::read's.
    virtual Result<std::shared_ptr<const ImagePieces>> images() const { return std::shared_ptr<const ImagePieces>(); }
    /// The name of the pages' file, for errors; empty where there is none, or several.
    [[nodiscard]] virtual std::string name() const { return {}; }
    [[nodiscard]] virtual PageOrigin originOf(Request request) const { return {name(), request}; }
};

/// Reads the pages of a .vcp file behind any ByteReader (openFile for a local one). Keeps none but by keepWithin().
class FilePageSource final : public PageSource {
public:
    /// `runBytes`: pages that lie together are read together up to so many stored bytes. This helps where a read takes
    /// long however short it is; 0: one page at a time.
    FilePageSource(std::shared_ptr<const ByteReader> reader, std::shared_ptr<const Dataset> dataset,
                   uint64_t runBytes = 0)
        : reader_(std::move(reader)), dataset_(std::move(dataset)), runBytes_(runBytes) {}

    Result<PageBytes> read(Request request, bool withColour) const override;
    std::vector<Result<PageBytes>> readRun(Request first, uint32_t count, bool withColour) const override;
    [[nodiscard]] uint32_t runFrom(Request first, uint32_t most, bool withColour) const override;
    [[nodiscard]] uint64_t bytesToRead(Request request, bool withColour) const override;
    uint64_t keepWithin(uint64_t bytes) const override { return kept_.limitTo(bytes); }
    void interrupt() const override { reader_->interrupt(); }
    Result<std::shared_ptr<const ImagePieces>> images() const override;
    [[nodiscard]] std::string name() const override { return reader_->name(); }

private:
    Result<PageBytes> readFrom(const ByteReader& bytes, uint64_t page, bool withColour) const;
    std::vector<Result<PageBytes>> readPages(uint64_t first, uint32_t count, bool withColour) const;
    [[nodiscard]] uint32_t pageRunFrom(uint64_t first, uint32_t most, bool withColour) const;
    std::vector<Result<PageBytes>> readBlocks(uint64_t first, uint32_t count) const;
    [[nodiscard]] uint32_t pieceRunFrom(uint64_t first, uint32_t most) const;
    std::vector<Result<PageBytes>> readPieces(uint64_t first, uint32_t count) const;
    [[nodiscard]] std::shared_ptr<const ImagePieces> knownImages() const;

    std::shared_ptr<const ByteReader> reader_;
    std::shared_ptr<const Dataset> dataset_;
    uint64_t runBytes_;
    mutable StoredPages kept_;
    mutable std::mutex mutex_;
    mutable std::shared_ptr<const ImagePieces> images_;  // null until they are asked for
};

}  // namespace vcp
