// What `vcp build --shards` and `vcp shard` have in common.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "streaming/shard/shard_folder.h"
#include "viewer/command/commands.h"

namespace vcp {

/// Adds an option for the size of shards, called `name`.
void addShardBytes(CLI::App& app, const std::string& name, uint64_t& bytes);

/// Cuts a file into shards, with its progress on stderr, until the terminal interrupts. Errors: writeShards's.
Result<ShardReport> shardWithProgress(const ByteReader& file, const std::string& folder, uint64_t shardBytes,
                                      std::vector<std::filesystem::path> inputs, ProgressStyle style);

Json toJson(const ShardReport& report);
/// Returns a text such as "1.2 GB in 9 shards and manifest.vcps".
std::string summary(const ShardReport& report);

}  // namespace vcp
