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
};

/// Packs a page with octree/page/page_codec.h; the same page gives the same bytes everywhere. Errors of a draft:
/// InvalidInput (there is no such page).
StoredPage compressPage(std::span<const std::byte> geometry, std::span<const std::byte> colour);
Result<StoredPage> compressPage(const PageDraft& draft, std::span<const std::byte> colour);

/// Writes one file, in one thread. Removes the partial file when destroyed before commit.
class VcpWriter {
public:
    /// `pages` is the final number of pages: it fixes the directory's size. Errors: Io.
    static Result<std::unique_ptr<VcpWriter>> create(const std::filesystem::path& output, uint64_t pages,
                                                     const OutputRules& rules = {});
    VcpWriter(const VcpWriter&) = delete;
    VcpWriter& operator=(const VcpWriter&) = delete;

    /// Appends the next page in directory order; fills offsets, sizes and hashes of `entry` (the caller sets
    /// the rest). Errors: Io.
    Result<void> append(PageEntry entry, const StoredPage& page);

    /// Writes the tables of the images behind the pages that were appended. `tables`: without the tiles' offsets; their
    /// hashes and sizes are known. The tiles follow, by appendTile. Errors: Io.
    Result<void> beginImages(ImageTables tables);
    /// Appends the stored bytes of the next tile of the table. Errors: Io.
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
