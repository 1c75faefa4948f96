// Writes a .vcp file: OUT.vcp.partial, then fsync, rename, fsync of the folder. OUT.vcp is whole or absent.
#pragma once

#include <filesystem>
#include <memory>

#include "octree/result.h"
#include "octree/vcp_file.h"

namespace vcp {

/// A page as it is stored in the file.
struct StoredPage {
    std::vector<std::byte> geometry;
    std::vector<std::byte> colour;
    uint32_t geometryBytes = 0;  ///< decoded
    uint32_t colourBytes = 0;
};

/// By octree/page_codec.h; the same bytes for the same page everywhere.
StoredPage compressPage(std::span<const std::byte> geometry, std::span<const std::byte> colour);

/// One thread. Removes the partial file when destroyed before commit.
class VcpWriter {
public:
    /// `pages` is the final number of pages: it fixes the directory's size. Errors: Io.
    static Result<std::unique_ptr<VcpWriter>> create(const std::filesystem::path& output, uint64_t pages);
    ~VcpWriter();
    VcpWriter(const VcpWriter&) = delete;
    VcpWriter& operator=(const VcpWriter&) = delete;

    /// Appends the next page in directory order; fills offsets, sizes and hashes of `entry` (the caller sets
    /// the rest). Errors: Io.
    Result<void> append(PageEntry entry, const StoredPage& page);

    /// Writes header, directory and commit record, makes the file durable and gives it its name. The caller
    /// fills the header but for sizes, flags of the layout and hashes. Returns the file's bytes. Errors: Io.
    Result<uint64_t> commit(FileHeader header);

private:
    VcpWriter() = default;
    Result<void> write(uint64_t offset, std::span<const std::byte> bytes);

    std::filesystem::path output_, partial_;
    int file_ = -1;
    uint64_t end_ = 0;
    uint64_t pages_ = 0;
    std::vector<PageEntry> entries_;
};

}  // namespace vcp
