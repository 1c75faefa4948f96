// Manifests of shards behind right hashes, and shards that do not belong to them: read as one file they give bytes or
// an error of one line, and ask for no byte that is not there.
//
// The input: a ManifestHeader, a FileHeader, how many shards, runs and kept blocks follow (16 bits each), their rows
// and numbers, the kept blocks, then the shards, each as long as its row says. Hashes are made here.
#include <cstdio>
#include <cstdlib>

#include "octree/vcp_verify.h"
#include "streaming/shard/sharded_reader.h"
#include "tests/fuzz/hostile_file.h"

namespace {

using namespace vcp;
using fuzz::MemoryFile;
using fuzz::take;
using Bytes = std::vector<std::byte>;

constexpr uint64_t kMostBytes = 1 << 18;

void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "broken: %s\n", what);
    std::abort();
}

template <class Row>
std::vector<Row> takeRows(std::span<const std::byte>& from, size_t count) {
    std::vector<Row> rows(std::min(count, from.size() / sizeof(Row)));
    for (Row& row : rows) row = take<Row>(from);
    return rows;
}

Bytes takeBytes(std::span<const std::byte>& from, uint64_t count) {
    Bytes bytes(from.begin(), from.begin() + std::ptrdiff_t(std::min<uint64_t>(count, from.size())));
    from = from.subspan(bytes.size());
    return bytes;
}

void hashBlock(std::span<std::byte> block) {
    const uint64_t hash = hashBytes(block.first(kBlockBytes - 8));
    std::memcpy(&block[kBlockBytes - 8], &hash, sizeof hash);
}

/// Gives the first 4096 bytes of a file the hash that they must have; returns it.
uint64_t hashHeader(std::span<std::byte> start) {
    FileHeader header;
    std::memcpy(static_cast<void*>(&header), start.data(), sizeof header);
    header.hash = 0;
    std::memcpy(start.data(), &header, sizeof header);
    header.hash = hashBytes(start.first(kDirectoryOffset));
    std::memcpy(start.data(), &header, sizeof header);
    return header.hash;
}

CommitRecord commitOf(uint64_t fileBytes, uint64_t headerHash, uint64_t directoryHash) {
    CommitRecord commit;
    commit.fileBytes = fileBytes;
    commit.headerHash = headerHash;
    commit.directoryHash = directoryHash;
    commit.hash = hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(CommitRecord, hash)));
    return commit;
}

/// A shard as its writer would have left it: hashes of header, directory and commit record.
void hashShard(Bytes& file) {
    if (file.size() < kDirectoryOffset + kBlockBytes + sizeof(CommitRecord)) return;
    FileHeader header;
    std::memcpy(static_cast<void*>(&header), file.data(), sizeof header);
    const uint64_t room = (file.size() - kDirectoryOffset - sizeof(CommitRecord)) / kBlockBytes;
    const uint64_t blocks = std::min(blocksOf(std::min<uint64_t>(header.pages, kMostBytes)), room);
    for (uint64_t b = 0; b < blocks; ++b) hashBlock(std::span(file).subspan(blockOffset(b), kBlockBytes));
    const uint64_t directory = hashBytes(std::span(file).subspan(kDirectoryOffset, blocks * kBlockBytes));
    const CommitRecord commit = commitOf(file.size(), hashHeader(file), directory);
    std::memcpy(&file[file.size() - sizeof commit], &commit, sizeof commit);
}

/// What an input stands for.
struct Shards {
    Bytes manifest;
    std::vector<ShardRow> rows;
    std::vector<Bytes> files;
};

Shards shardsOf(std::span<const std::byte> input) {
    Shards made;
    auto header = take<ManifestHeader>(input);
    Bytes start(kDirectoryOffset);
    const auto fileHeader = take<FileHeader>(input);
    std::memcpy(start.data(), &fileHeader, sizeof fileHeader);
    header.commit = commitOf(fileHeader.fileBytes, hashHeader(start), header.commit.directoryHash);
    const auto shards = take<uint16_t>(input), runs = take<uint16_t>(input), blocks = take<uint16_t>(input);
    made.rows = takeRows<ShardRow>(input, shards);
    const auto runRows = takeRows<PageRun>(input, runs);
    std::vector<KeptBlock> kept;
    for (const uint64_t number : takeRows<uint64_t>(input, blocks)) kept.push_back({number, Bytes(kBlockBytes)});
    for (KeptBlock& block : kept) {
        const Bytes bytes = takeBytes(input, kBlockBytes);
        std::copy(bytes.begin(), bytes.end(), block.bytes.begin());
        hashBlock(block.bytes);
    }
    for (const ShardRow& row : made.rows) {
        made.files.push_back(takeBytes(input, row.bytes));
        hashShard(made.files.back());
    }
    made.manifest = storedManifest(header, start, made.rows, runRows, kept);
    return made;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size > kMostBytes) return 0;
    const Shards shards = shardsOf(std::as_bytes(std::span(data, size)));
    const auto opened = ShardedReader::open(
        std::make_shared<MemoryFile>(shards.manifest),
        [&](const ShardRow& row, bool, const std::function<bool()>&) -> Result<std::shared_ptr<const ByteReader>> {
            for (size_t i = 0; i < shards.rows.size(); ++i)
                if (shardName(shards.rows[i]) == shardName(row))
                    return std::shared_ptr<const ByteReader>(std::make_shared<MemoryFile>(shards.files[i]));
            return Error{.code = ErrorCode::Io, .message = "is not there", .file = shardName(row)};
        });
    if (!opened) {
        require(!opened.error().file.empty() && opened.error().line().find('\n') == std::string::npos,
                "what is refused is said in a line");
        return 0;
    }
    const ShardedReader& reader = **opened;
    const auto dataset = readDataset(reader);
    if (reader.size() > kMostBytes) return 0;
    // Where all can be read, parts of it are the same bytes.
    Bytes whole(reader.size());
    const auto read = reader.read(0, whole);
    if (!read) {
        require(read.error().line().find('\n') == std::string::npos, "an error is one line");
        return 0;
    }
    for (uint64_t step = 1; step < reader.size(); step *= 7) {
        Bytes part(std::min<uint64_t>(step + 100, reader.size() - step));
        require(reader.read(step, part).ok(), "what was read is read again");
        require(std::memcmp(part.data(), &whole[step], part.size()) == 0, "parts are those of the whole");
    }
    if (dataset.ok()) static_cast<void>(verifyFile(reader));
    return 0;
}
