// Folders of shards: writes a .vcp file as one, and the one file from it; opens and checks them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "octree/io/byte_reader.h"
#include "octree/io/output_file.h"
#include "octree/io/result.h"
#include "streaming/shard/sharded_reader.h"

namespace vcp {

struct ShardOptions {
    std::filesystem::path folder;                    ///< what is written; it appears whole, under its name
    uint64_t shardBytes = uint64_t{512} << 20;       ///< of a shard, about; at least kLeastShardBytes
    std::vector<std::filesystem::path> inputs = {};  ///< files that are read, and never replaced
    std::function<bool(double)> progress = {};       ///< called with the share that is done; false cancels
};
inline constexpr uint64_t kLeastShardBytes = uint64_t{64} << 10;

struct ShardReport {
    uint64_t shards = 0, bytes = 0;  ///< of all files
    uint64_t shardsKept = 0;         ///< that were in the folder before
};

/// Cuts a .vcp file into shards. A folder of shards that is there is replaced; of these, the files that stay the same
/// are kept as they are, so that what copies folders by name has less to do. Memory: the file's directory twice, a
/// page, the coarse levels of images and the manifest. Errors: InvalidInput (the file is damaged), Usage (the folder
/// holds something else), Io, Cancelled.
Result<ShardReport> writeShards(const ByteReader& file, const ShardOptions& options);

/// Checks, as writeShards would, what is at the folder's name, and leaves nothing behind. Errors: Usage, Io.
Result<void> checkShardFolder(const ShardOptions& options);

/// Checks all that `reader` reads, whatever from, and writes it as one file. Errors: InvalidInput, Io, Cancelled.
Result<void> packShards(const ByteReader& reader, const std::filesystem::path& output, const OutputRules& rules,
                        const std::function<bool(double)>& progress);

/// Opens a .vcp file, a manifest of shards, or the folder of one. Errors: those of openFile and ShardedReader::open.
Result<std::shared_ptr<const ByteReader>> openDatasetFile(const std::filesystem::path& path);

/// Checks that each shard is the file that its name says. `progress` is called with the share of the bytes that are
/// checked; false cancels. Errors: InvalidInput, Io, Cancelled.
Result<void> verifyShards(const ShardedReader& reader, const std::function<bool(double)>& progress);

}  // namespace vcp
