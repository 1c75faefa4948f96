// A dataset in shards, read as the one .vcp file whose parts they are: byte for byte, and no more of it than is asked
// for.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "octree/io/byte_reader.h"
#include "octree/io/result.h"
#include "streaming/shard/shard_manifest.h"

namespace vcp {

/// Opens the file of a shard, whose name is shardName(shard). `isFirst`: whether it is shard 0, which a first picture
/// needs. Once `cancelled` returns true, opening ends soon with Cancelled; of an open file's reads it says nothing.
using OpenShard = std::function<Result<std::shared_ptr<const ByteReader>>(const ShardRow& shard, bool isFirst,
                                                                          const std::function<bool()>& cancelled)>;

/// Shards are opened when they are first read from, and the ones used last stay open: at most kMostOpen of them. Memory
/// and the reads of a first picture do not depend on how many there are. Entries of the directory are checked by the
/// hashes of the shards' blocks; pages by whoever reads them.
class ShardedReader final : public ByteReader {
public:
    static constexpr size_t kMostOpen = 32;

    /// Errors: ShardManifest::open's.
    static Result<std::shared_ptr<ShardedReader>> open(std::shared_ptr<const ByteReader> manifest, OpenShard openShard);

    /// Errors: InvalidInput (a shard or the manifest is damaged, or they do not belong together), those of OpenShard.
    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override;
    [[nodiscard]] uint64_t size() const override { return manifest_->fileHeader().fileBytes; }
    [[nodiscard]] const std::string& name() const override { return manifest_->reader().name(); }
    void interrupt() const override;
    void distrust(uint64_t offset, uint64_t bytes) const override;

    [[nodiscard]] const ShardManifest& manifest() const { return *manifest_; }
    /// Returns a shard's file. Errors: InvalidInput (it has another size), those of OpenShard.
    [[nodiscard]] Result<std::shared_ptr<const ByteReader>> shardFile(uint64_t number) const;

private:
    struct Shard;
    struct Segment;

    ShardedReader(std::unique_ptr<ShardManifest> manifest, OpenShard openShard)
        : manifest_(std::move(manifest)), openShard_(std::move(openShard)) {}
    [[nodiscard]] std::shared_ptr<Shard> slotOf(uint64_t number) const;
    [[nodiscard]] Result<std::shared_ptr<const ByteReader>> openedShard(uint64_t number,
                                                                        const std::function<bool()>& cancelled) const;
    Result<void> readDirectory(uint64_t offset, std::span<std::byte> bytes) const;
    Result<void> makeBlocks(uint64_t first, std::span<std::byte> made) const;
    [[nodiscard]] Result<std::vector<Segment>> segments(uint64_t firstPage, uint64_t endPage) const;
    Result<void> copyEntries(std::span<const Segment> segments, uint64_t firstPage, std::span<std::byte> blocks) const;
    Result<void> readPages(uint64_t offset, std::span<std::byte> bytes) const;
    Result<void> readImages(uint64_t offset, std::span<std::byte> bytes) const;

    std::unique_ptr<ShardManifest> manifest_;
    OpenShard openShard_;
    mutable std::mutex mutex_;
    mutable std::unordered_map<uint64_t, std::shared_ptr<Shard>> open_;  // by number
    mutable uint64_t uses_ = 0;
    mutable std::atomic<uint64_t> interrupts_ = 0;
};

}  // namespace vcp
