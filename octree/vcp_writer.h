// Writes a .vcp file through OUT.vcp.partial (octree/io/output_file.h): OUT.vcp is whole or absent.
#pragma once

#include <filesystem>
#include <memory>

#include "octree/image/image_tables.h"
#include "octree/io/output_file.h"
#include "octree/io/result.h"
#include "octree/page/page_draft.h"
#include "octree/vcp_file.h"

namespace vcp {

/// Returns where a page begins that follows so many bytes.
constexpr uint64_t alignPage(uint64_t bytes) { return (bytes + kPageAlignment - 1) & ~(kPageAlignment - 1); }

/// A page as it is stored in the file.
struct StoredPage {
    std::vector<std::byte> geometry;
    std::vector<std::byte> colour;
    uint32_t geometryBytes = 0;  ///< bytes of the decoded geometry
    uint32_t colourBytes = 0;

    /// Fills in the sizes and the hashes that the page's entry has.
    void describe(PageEntry& entry) const;
};

/// Packs a page with octree/page/page_codec.h; the same page gives the same bytes everywhere. Errors of a draft:
/// InvalidInput (there is no such page).
StoredPage compressPage(std::span<const std::byte> geometry, std::span<const std::byte> colour);
Result<StoredPage> compressPage(const PageDraft& draft, std::span<const std::byte> colour);

/// Writes one file: what is placed, in one thread; the bytes, from any. Removes the partial file when destroyed before
/// commit.
class VcpWriter {
public:
    /// `pages` is the final number of pages: it fixes the directory's size. Errors: Io.
    static Result<std::unique_ptr<VcpWriter>> create(const std::filesystem::path& output, uint64_t pages,
                                                     const OutputRules& rules = {});
    VcpWriter(const VcpWriter&) = delete;
    VcpWriter& operator=(const VcpWriter&) = delete;

    /// Gives the next page in directory order its place, behind the one before. `entry`: all but the offsets, which are
    /// filled in. Returns the page's number, from 0.
    size_t place(PageEntry entry);
    /// Writes the bytes of a page that was placed, those that its entry has the sizes and hashes of; any thread, in any
    /// order, while nothing is placed. Errors: Io.
    Result<void> write(size_t number, const StoredPage& page);
    /// Places the next page and writes it; fills sizes and hashes of `entry`, too. Errors: Io.
    Result<void> append(const PageEntry& entry, const StoredPage& page);

    /// Writes the tables of the images behind the pages that were appended. `tables`: without the tiles' offsets; their
    /// hashes and sizes are known. The tiles follow, in the table's order. Errors: Io.
    Result<void> beginImages(ImageTables tables);
    /// Gives the stored bytes of the next tile their place, and returns it.
    uint64_t placeTile(uint64_t bytes);
    /// Writes a tile where it was placed; any thread, in any order. Errors: Io.
    Result<void> writeTile(uint64_t offset, std::span<const std::byte> stored);
    /// Places the next tile, or the next bytes of it, and writes them. Errors: Io.
    Result<void> appendTile(std::span<const std::byte> stored);

    /// Writes header, directory and commit record, makes the file durable and gives it its name. The caller
    /// fills the header but for sizes, version, flags of the layout and hashes. Returns the file's bytes. Errors: Io.
    Result<uint64_t> commit(FileHeader header);

private:
    VcpWriter(OutputFile file, uint64_t pages);

    OutputFile file_;
    uint64_t end_;
    uint64_t pages_;
    std::vector<PageEntry> entries_;
    ImagesPlace images_;
};

}  // namespace vcp
