#include "octree/dataset_reader.h"

#include <cmath>
#include <cstring>
#include <new>
#include <optional>

#include <fmt/format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include "octree/directory_check.h"
#include "octree/header_check.h"
#include "octree/io/content_hash.h"
#include "octree/surface/morton.h"

namespace vcp {

double Dataset::cellOf(uint32_t level) const { return std::ldexp(header.cell, int(header.levels - 1 - level)); }

double Dataset::slabEdgeOf(uint32_t level) const {
    return (header.flags & kFlagFineSlabs) != 0 ? cellOf(level) / 2 : cellOf(level);
}

double Dataset::edgeOf(const PageEntry& page) const { return std::ldexp(cellOf(page.level), int(header.log2Cells)); }

glm::dvec3 Dataset::originOf(const PageEntry& page) const {
    return glm::dvec3(header.origin[0], header.origin[1], header.origin[2]) +
           edgeOf(page) * glm::dvec3(mortonDecode(page.morton));
}

namespace {

Result<FileHeader> readHeader(const ByteReader& reader) {
    if (reader.size() < kDirectoryOffset + kBlockBytes + sizeof(CommitRecord))
        return brokenBytes(reader.name(), "header", reader.size(),
                           reader.size() == 0 ? "the file is empty" : "the file is too short for a .vcp file");
    FileHeader header;
    std::vector<std::byte> first(kDirectoryOffset);
    VCP_TRY(reader.read(0, first));
    std::memcpy(&header, first.data(), sizeof(FileHeader));
    VCP_TRY(checkHeader(reader.name(), header, first, reader.size()));
    if (blocksOf(header.pages) * kBlockBytes > reader.size() - kDirectoryOffset - sizeof(CommitRecord))
        return brokenBytes(reader.name(), "header", 24, "the directory does not fit the file");
    return header;
}

/// `directoryHash`: hash of the directory's bytes, where all of them are there.
Result<void> checkCommitRecord(const ByteReader& reader, const FileHeader& header,
                               std::optional<uint64_t> directoryHash) {
    CommitRecord commit;
    const uint64_t offset = reader.size() - sizeof commit;
    VCP_TRY(reader.read(offset, std::as_writable_bytes(std::span(&commit, 1))));
    if (std::memcmp(commit.magic, CommitRecord{}.magic, 8) != 0 || commit.fileBytes != reader.size() ||
        commit.headerHash != header.hash || (directoryHash && commit.directoryHash != *directoryHash) ||
        commit.hash != hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(CommitRecord, hash))))
        return brokenBytes(reader.name(), "commit record", offset,
                           "does not match the file: it was not finished, changed or damaged");
    for (size_t i = 0; i < std::size(commit.reserved); ++i)
        if (commit.reserved[i] != 0)
            return brokenBytes(reader.name(), "commit record", offset + offsetof(CommitRecord, reserved) + 8 * i,
                               "reserved bytes must be zero");
    return {};
}

/// Appends the entries of the blocks that follow those already there, each block checked against its hash.
Result<void> appendBlocks(Dataset& dataset, const std::string& file, std::span<const std::byte> blocks) {
    for (uint64_t from = 0; from < blocks.size(); from += kBlockBytes) {
        const std::span block = blocks.subspan(from, kBlockBytes);
        const uint64_t first = dataset.pages.size(),
                       count = std::min<uint64_t>(kEntriesPerBlock, dataset.header.pages - first);
        VCP_TRY(checkBlock(file, first / kEntriesPerBlock, count, block));
        for (uint64_t i = 0; i < count; ++i) {
            PageEntry entry;
            std::memcpy(&entry, block.data() + i * sizeof entry, sizeof entry);
            dataset.pages.push_back(entry);
        }
    }
    return {};
}

/// A file that claims more pages than it has fails at the first block that does not match its hash.
Result<Dataset> readWhole(const ByteReader& reader, const FileHeader& header) {
    Dataset dataset{header, {}};
    XXH3_state_t hash;
    XXH3_64bits_reset(&hash);
    VCP_TRY(readInPieces(reader, kDirectoryOffset, blocksOf(header.pages) * kBlockBytes,
                         [&](std::span<const std::byte> piece) {
                             XXH3_64bits_update(&hash, piece.data(), piece.size());
                             return appendBlocks(dataset, reader.name(), piece);
                         }));
    VCP_TRY(checkCommitRecord(reader, header, XXH3_64bits_digest(&hash)));
    VCP_TRY(checkDirectory(reader.name(), dataset));
    return dataset;
}

}  // namespace

Result<Dataset> readDataset(const ByteReader& reader) {
    VCP_TRY_ASSIGN(const auto header, readHeader(reader));
    return readWhole(reader, header);
}

Result<Dataset> readDatasetStart(const ByteReader& reader, uint64_t leadBytes) {
    VCP_TRY_ASSIGN(const auto header, readHeader(reader));
    if (blocksOf(header.pages) * kBlockBytes <= wholeDirectoryBytes(leadBytes)) return readWhole(reader, header);
    Dataset dataset{header, {}};
    std::vector<std::byte> lead(leadBytes - kDirectoryOffset);
    VCP_TRY(reader.read(kDirectoryOffset, lead));
    VCP_TRY(checkCommitRecord(reader, header, {}));
    try {
        dataset.pages.expect(header.pages);
    } catch (const std::bad_alloc&) {
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a directory of {} pages needs more addresses than this process may have",
                                            header.pages),
                     .file = reader.name()};
    }
    for (uint64_t b = 0; b < lead.size() / kBlockBytes; ++b)
        VCP_TRY(admitBlock(dataset, reader.name(), b, std::span(lead).subspan(b * kBlockBytes, kBlockBytes)));
    return dataset;
}

}  // namespace vcp
