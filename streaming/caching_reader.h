// Keeps on disk what was read from somewhere slow: wraps any reader.
//
// The folder holds files of 32 KiB of the source each, with an XXH3-64 in front, named by a hash of the
// source's identity and the block's number. A block that does not match its hash is removed and read again.
// When the folder holds more than its limit, the blocks used longest ago go. Several readers and processes
// may share a folder: blocks appear by a rename. Nothing else in the folder is touched.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>
#include "octree/io/byte_reader.h"

namespace vcp {

inline constexpr uint64_t kCacheBlockBytes = 32 << 10;

class CachingReader final : public ByteReader {
public:
    /// `identity`: equal for equal bytes (HttpReader::identity). Makes the folder. Errors: Io.
    static Result<std::shared_ptr<CachingReader>> open(std::shared_ptr<const ByteReader> reader,
                                                       const std::string& identity, const std::filesystem::path& folder,
                                                       uint64_t limitBytes);

    /// A block that cannot be kept (a full disk) is no error: it is read from the source again next time.
    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override;
    [[nodiscard]] uint64_t size() const override { return reader_->size(); }
    [[nodiscard]] const std::string& name() const override { return reader_->name(); }
    void interrupt() const override { reader_->interrupt(); }
    void distrust(uint64_t offset, uint64_t bytes) const override;

    /// Bytes of the folder's blocks, as far as this reader knows.
    [[nodiscard]] uint64_t bytesKept() const;

private:
    CachingReader(std::shared_ptr<const ByteReader> reader, uint64_t source, std::filesystem::path folder,
                  uint64_t limitBytes)
        : reader_(std::move(reader)), source_(source), folder_(std::move(folder)), limitBytes_(limitBytes) {}
    [[nodiscard]] std::filesystem::path pathOf(uint64_t block) const;
    [[nodiscard]] uint64_t sizeOf(uint64_t block) const;
    bool load(uint64_t block, std::span<std::byte> bytes) const;
    void keep(uint64_t block, std::span<const std::byte> bytes) const;
    void trim() const;

    std::shared_ptr<const ByteReader> reader_;
    uint64_t source_;
    std::filesystem::path folder_;
    uint64_t limitBytes_;
    mutable std::mutex mutex_;
    mutable uint64_t kept_ = 0;
};

}  // namespace vcp
