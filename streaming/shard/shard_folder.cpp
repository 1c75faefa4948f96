#include "streaming/shard/shard_folder.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include "octree/io/content_hash.h"
#include "octree/io/durable_file.h"
#include "octree/io/output_folder.h"
#include "octree/vcp_verify.h"
#include "octree/vcp_writer.h"
#include "streaming/shard/shard_images.h"
#include "streaming/shard/shard_manifest.h"
#include "streaming/shard/shard_split.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;

FolderRules rulesOf(const ShardOptions& options) {
    return {.isOurs = [](std::string_view name) { return name == kManifestName || isShardName(name); },
            .ofWhat = "a dataset in shards",
            .overwrite = true,
            .howToReplace = {},
            .inputs = options.inputs};
}

/// The name of a shard, as ShardRow has it.
using ContentName = std::array<uint64_t, 2>;

/// Returns the name that a file's bytes have. `progress` is called with how many are read; false cancels.
Result<ContentName> contentNameOf(const ByteReader& file, const std::function<bool(uint64_t)>& progress) {
    XXH3_state_t hash;
    XXH3_128bits_reset(&hash);
    uint64_t done = 0;
    VCP_TRY(readInPieces(file, 0, file.size(), [&](std::span<const std::byte> piece) -> Result<void> {
        XXH3_128bits_update(&hash, piece.data(), piece.size());
        done += piece.size();
        return progress(done) ? Result<void>() : Error::cancelled();
    }));
    const XXH128_hash_t digest = XXH3_128bits_digest(&hash);
    return ContentName{digest.low64, digest.high64};
}

/// Writes the shards of a file, one after the other, and then their manifest.
class FolderWriter {
public:
    FolderWriter(const ByteReader& file, const Dataset& dataset, const ShardOptions& options, OutputFolder folder)
        : file_(file),
          whole_(dataset),
          options_(options),
          folder_(std::move(folder)),
          split_(splitIntoShards(dataset, options.shardBytes)),
          local_(dataset.pages.size()),
          shardOffset_(dataset.pages.size()) {}

    Result<ShardReport> run() {
        numberPages();
        if (whole_.hasImages() && split_.firstPages.size() > 1) {
            VCP_TRY_ASSIGN(images_, coarseImages(file_, whole_.header));
        }
        for (uint32_t shard = 0; shard < split_.firstPages.size(); ++shard) VCP_TRY(writeShard(shard));
        VCP_TRY(writeManifest());
        VCP_TRY(folder_.commit());
        return report_;
    }

private:
    [[nodiscard]] std::span<const uint64_t> pagesOf(uint32_t shard) const {
        return std::span(pages_).subspan(begin_[shard], begin_[shard + 1] - begin_[shard]);
    }

    /// Lists the pages of each shard, and numbers them there. In all shards but the first, the first one is the copy of
    /// a page that another owns.
    void numberPages() {
        begin_.assign(split_.firstPages.size() + 1, 0);
        for (size_t shard = 1; shard < split_.firstPages.size(); ++shard) begin_[shard + 1] = 1;
        for (const uint32_t owner : split_.owner) ++begin_[owner + 1];
        std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
        pages_.resize(begin_.back());
        std::vector<uint64_t> next(begin_.begin(), begin_.end() - 1);
        for (size_t shard = 1; shard < split_.firstPages.size(); ++shard)
            pages_[next[shard]++] = split_.firstPages[shard];
        for (uint64_t page = 0; page < split_.owner.size(); ++page) {
            const uint32_t owner = split_.owner[page];
            local_[page] = uint32_t(next[owner] - begin_[owner]);
            pages_[next[owner]++] = page;
        }
    }

    /// Returns the entry of a page as a shard has it.
    [[nodiscard]] PageEntry entryIn(uint32_t shard, uint64_t page) const {
        const PageEntry& first = whole_.pages[split_.firstPages[shard]];
        PageEntry entry = whole_.pages[page];
        entry.level = uint8_t(entry.level - first.level);
        entry.morton -= first.morton << (3 * entry.level);
        entry.colourOffset = entry.colourHash = 0;
        const bool continuesElsewhere = split_.shardFrom(page) != 0 && split_.firstPages[shard] != page;
        if (continuesElsewhere) entry.childMask = 0;
        entry.firstChild = entry.childMask != 0 ? local_[entry.firstChild] : 0;
        return entry;
    }

    Result<StoredPage> storedPage(uint64_t page) const {
        const PageEntry& e = whole_.pages[page];
        StoredPage stored{std::vector<std::byte>(e.storedBytes), std::vector<std::byte>(e.colourStoredBytes),
                          e.pageBytes, e.colourBytes};
        VCP_TRY(file_.read(e.offset, stored.geometry));
        if (!stored.colour.empty()) VCP_TRY(file_.read(e.colourOffset, stored.colour));
        if (hashBytes(stored.geometry) != e.hash ||
            (!stored.colour.empty() && hashBytes(stored.colour) != e.colourHash))
            return brokenBytes(file_.name(), fmt::format("page {}", page), e.offset,
                               "hash does not match: the page was changed or damaged");
        return stored;
    }

    /// Returns the header of a shard, but for what the writer fills in. Those beside the first say nothing of the mesh
    /// as a whole, so that they stay the same where another part of it changes.
    [[nodiscard]] FileHeader headerOf(uint32_t shard, const std::vector<PageEntry>& entries) const {
        const PageEntry& first = whole_.pages[split_.firstPages[shard]];
        FileHeader header = whole_.header;
        header.version = kFileVersion;
        header.flags &= ~(kFlagMarks | kFlagImages | kFlagChannels | kFlagColourErrors);
        header.images = {};
        header.levels = entries.back().level + 1u;
        header.cell = whole_.cellOf(first.level + header.levels - 1);
        std::fill(std::begin(header.level), std::end(header.level), LevelRow{});
        FinestFigures finest;
        uint8_t kinds = 0;
        for (size_t i = 0; i < entries.size(); ++i) {
            LevelRow& row = header.level[entries[i].level];
            if (row.pages++ == 0) row.firstEntry = i;
            row.certifiedError = std::max(row.certifiedError, double(entries[i].certifiedError));
            finest.add(entries[i]);
            kinds |= entries[i].parts;
        }
        header.certifiedErrorMax = finest.certifiedError;
        header.leaves = finest.leaves;
        header.hardLeaves = finest.hardLeaves;
        if (shard == 0) return header;
        const glm::dvec3 low = whole_.originOf(first);
        const double edge = whole_.edgeOf(first);
        for (int axis = 0; axis < 3; ++axis) {
            header.origin[axis] = header.boundsMin[axis] = low[axis];
            header.boundsMax[axis] = low[axis] + edge;
        }
        header.triangles = header.degenerateTriangles = header.vertices = header.openEdges = 0;
        header.closedParts = (kinds & kPageHasClosed) != 0 ? 1 : 0;
        header.parts = header.closedParts + ((kinds & kPageHasOpen) != 0 ? 1 : 0);
        return header;
    }

    Result<void> writeShard(uint32_t shard) {
        const std::span<const uint64_t> pages = pagesOf(shard);
        const fs::path unnamed = folder_.unfinished() / "shard.vcp";
        VCP_TRY_ASSIGN(const auto writer, VcpWriter::create(unnamed, pages.size()));
        std::vector<PageEntry> entries;
        for (const uint64_t page : pages) {
            VCP_TRY_ASSIGN(const auto stored, storedPage(page));
            entries.push_back(entryIn(shard, page));
            VCP_TRY(writer->append(entries.back(), stored));
            VCP_TRY(advance(stored.geometry.size() + stored.colour.size()));
        }
        if (whole_.hasImages()) VCP_TRY(writeImages(shard, *writer));
        VCP_TRY_ASSIGN(const uint64_t bytes, writer->commit(headerOf(shard, entries)));
        return nameShard(shard, unnamed, bytes);
    }

    Result<void> writeImages(uint32_t shard, VcpWriter& writer) {
        if (shard == 0) return appendImages(file_, whole_.header, writer);
        VCP_TRY(writer.beginImages(images_.tables));
        for (const auto& tile : images_.tiles) VCP_TRY(writer.appendTile(tile));
        return {};
    }

    /// Notes where the pages of a finished shard are, and gives it its name.
    Result<void> nameShard(uint32_t shard, const fs::path& unnamed, uint64_t bytes) {
        VCP_TRY_ASSIGN(const auto file, openFile(unnamed));
        VCP_TRY_ASSIGN(const auto dataset, readDataset(*file));
        for (const uint64_t page : pagesOf(shard).subspan(shard > 0 ? 1 : 0))
            shardOffset_[page] = dataset.pages[local_[page]].offset;
        if (shard == 0 && whole_.hasImages()) {
            header_.shardImages = dataset.header.images.offset;
            VCP_TRY_ASSIGN(const auto tables, readImageTables(*file, dataset.header.images));
            header_.tiles = tables.tiles.size();
            header_.tileTable = tables.bytes() - tables.tiles.size() * sizeof(TileRow);
        }
        VCP_TRY_ASSIGN(const auto name, contentNameOf(*file, [&](uint64_t) { return goesOn(); }));
        const PageEntry& first = whole_.pages[split_.firstPages[shard]];
        shards_.push_back({.name = {name[0], name[1]},
                           .bytes = bytes,
                           .pages = dataset.pages.size(),
                           .morton = first.morton,
                           .level = first.level});
        report_.bytes += bytes;
        ++report_.shards;
        return keepOrRename(unnamed, shards_.back());
    }

    /// Takes the file of a shard that is there already, and intact, in place of the new one.
    Result<void> keepOrRename(const fs::path& unnamed, const ShardRow& shard) {
        std::error_code failed;
        const fs::path old = folder_.folder() / shardName(shard), made = folder_.unfinished() / shardName(shard);
        if (isIntact(old, shard)) {
            fs::create_hard_link(old, made, failed);
            if (!failed) {
                ++report_.shardsKept;
                fs::remove(unnamed, failed);
                return {};
            }
        }
        fs::rename(unnamed, made, failed);
        return failed ? Result<void>(systemError(made, "cannot be written", failed.value())) : Result<void>();
    }

    /// Whether a file is there and has the bytes that its name says.
    [[nodiscard]] bool isIntact(const fs::path& path, const ShardRow& shard) const {
        std::error_code failed;
        if (fs::file_size(path, failed) != shard.bytes || failed) return false;
        const auto file = openFile(path);
        if (!file) return false;
        const auto name = contentNameOf(**file, [&](uint64_t) { return goesOn(); });
        return name && *name == ContentName{shard.name[0], shard.name[1]};
    }

    /// Returns the runs, and checks that the file is laid out as shards are.
    Result<std::vector<PageRun>> runs() const {
        std::vector<PageRun> runs;
        bool wasCut = false;
        for (uint64_t page = 0; page < whole_.pages.size(); ++page) {
            const PageEntry& e = whole_.pages[page];
            const uint32_t owner = split_.owner[page];
            const bool isCut = split_.shardFrom(page) != 0;
            if (page == 0 || isCut || wasCut || owner != runs.back().shard || e.level != whole_.pages[page - 1].level)
                runs.push_back({.firstPage = page,
                                .offset = e.offset,
                                .shardOffset = shardOffset_[page],
                                .firstChild = isCut ? int64_t{e.firstChild} : 0,
                                .shard = owner,
                                .shardPage = local_[page],
                                .childMask = isCut ? e.childMask : uint8_t{0}});
            wasCut = isCut;
            PageRun& run = runs.back();
            if (e.offset - run.offset != shardOffset_[page] - run.shardOffset)
                return brokenBytes(file_.name(), fmt::format("page {}", page), e.offset,
                                   "does not lie where this program puts it; build the file again");
            if (!isCut && e.childMask != 0) run.firstChild = int64_t{e.firstChild} - int64_t{local_[e.firstChild]};
        }
        return runs;
    }

    Result<void> writeManifest() {
        VCP_TRY_ASSIGN(const auto all, runs());
        std::vector<std::byte> fileHeader(kDirectoryOffset);
        VCP_TRY(file_.read(0, fileHeader));
        VCP_TRY(file_.read(file_.size() - sizeof(CommitRecord), std::as_writable_bytes(std::span(&header_.commit, 1))));
        std::vector<KeptBlock> kept;
        for (const uint64_t block : blocksToKeep(all, whole_.header.pages)) {
            kept.push_back({block, std::vector<std::byte>(kBlockBytes)});
            VCP_TRY(file_.read(blockOffset(block), kept.back().bytes));
        }
        const std::vector<std::byte> bytes = storedManifest(header_, fileHeader, shards_, all, kept);
        report_.bytes += bytes.size();
        return writeFile(folder_.unfinished() / kManifestName, OutputKind::Dataset, bytes);
    }

    Result<void> advance(uint64_t bytes) {
        done_ += bytes;
        return goesOn() ? Result<void>() : Error::cancelled();
    }
    [[nodiscard]] bool goesOn() const {
        return !options_.progress || options_.progress(std::min(1.0, double(done_) / double(file_.size())));
    }

    const ByteReader& file_;
    const Dataset& whole_;
    const ShardOptions& options_;
    OutputFolder folder_;
    ShardSplit split_;
    ShardImages images_;           ///< of all shards but the first
    std::vector<uint64_t> pages_;  ///< of all shards, one after the other
    std::vector<uint64_t> begin_;  ///< where each shard's are
    // For each page, its entry in the shard that owns it, and where it is there.
    std::vector<uint32_t> local_;
    std::vector<uint64_t> shardOffset_;
    std::vector<ShardRow> shards_;
    ManifestHeader header_;
    ShardReport report_;
    uint64_t done_ = 0;
};

}  // namespace

Result<void> checkShardFolder(const ShardOptions& options) {
    VCP_TRY_ASSIGN(const auto folder, OutputFolder::create(options.folder, rulesOf(options)));
    static_cast<void>(folder);
    return {};
}

Result<ShardReport> writeShards(const ByteReader& file, const ShardOptions& options) {
    VCP_TRY_ASSIGN(auto folder, OutputFolder::create(options.folder, rulesOf(options)));
    VCP_TRY_ASSIGN(const auto dataset, readDataset(file));
    if (dataset.header.method == Method::Paper)
        return Error{.code = ErrorCode::Usage,
                     .message = "is of the method paper, whose files are not cut into shards",
                     .file = file.name()};
    return FolderWriter(file, dataset, options, std::move(folder)).run();
}

Result<void> packShards(const ByteReader& reader, const fs::path& output, const OutputRules& rules,
                        const std::function<bool(double)>& progress) {
    VCP_TRY_ASSIGN(auto file, OutputFile::create(output, OutputKind::Dataset, rules));
    struct Telling {
        const std::function<bool(double)>& progress;
        double bytes;
    } telling{progress, double(reader.size())};
    VCP_TRY(verifyFile(
        reader,
        [](void* user, uint64_t done) {
            const auto& to = *static_cast<const Telling*>(user);
            return to.progress(0.5 * double(done) / to.bytes);
        },
        &telling));
    const auto copy = [&](uint64_t from, uint64_t end) {
        uint64_t at = from;
        return readInPieces(reader, from, end - from, [&](std::span<const std::byte> piece) -> Result<void> {
            VCP_TRY(file.write(at, piece));
            at += piece.size();
            return progress(0.5 + 0.5 * double(at) / telling.bytes) ? Result<void>() : Error::cancelled();
        });
    };
    // The header promises that all else is there.
    VCP_TRY(copy(kDirectoryOffset, reader.size()));
    VCP_TRY(file.sync());
    VCP_TRY(copy(0, kDirectoryOffset));
    return file.commit();
}

Result<std::shared_ptr<const ByteReader>> openDatasetFile(const std::filesystem::path& path) {
    std::error_code ignored;
    const bool isFolder = std::filesystem::is_directory(path, ignored);
    const std::filesystem::path named = isFolder ? path / kManifestName : path;
    VCP_TRY_ASSIGN(auto file, openFile(named));
    VCP_TRY_ASSIGN(const bool inShards, isManifest(*file));
    if (!inShards) return std::shared_ptr<const ByteReader>(file);
    VCP_TRY_ASSIGN(auto reader,
                   ShardedReader::open(file,
                                       [folder = named.parent_path()](
                                           const ShardRow& row, bool,
                                           const std::function<bool()>&) -> Result<std::shared_ptr<const ByteReader>> {
                                           VCP_TRY_ASSIGN(auto shard, openFile(folder / shardName(row)));
                                           return std::shared_ptr<const ByteReader>(shard);
                                       }));
    return std::shared_ptr<const ByteReader>(reader);
}

Result<void> verifyShards(const ShardedReader& reader, const std::function<bool(double)>& progress) {
    const uint64_t shards = reader.manifest().header().shards;
    for (uint64_t number = 0; number < shards; ++number) {
        VCP_TRY_ASSIGN(const auto row, reader.manifest().shard(number));
        VCP_TRY_ASSIGN(const auto file, reader.shardFile(number));
        VCP_TRY_ASSIGN(const auto name, contentNameOf(*file, [&](uint64_t done) {
                           return progress((double(number) + double(done) / double(row.bytes)) / double(shards));
                       }));
        if (name != ContentName{row.name[0], row.name[1]})
            return Error{.code = ErrorCode::InvalidInput,
                         .message = "its bytes are not those that its name stands for: it was changed or damaged",
                         .file = file->name()};
    }
    return {};
}

}  // namespace vcp
