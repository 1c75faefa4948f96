#include "mesostructure/asset_file.h"

#include <unistd.h>
#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "mesostructure/solids.h"
#include "octree/io/byte_reader.h"
#include "octree/io/content_hash.h"
#include "octree/io/durable_file.h"

namespace vcp::meso {

namespace {

constexpr uint64_t kAlignment = 64;
constexpr uint32_t kMaxChunks = 64;
constexpr uint64_t kMaxFileBytes = uint64_t{1} << 34;
constexpr size_t kPieceBytes = size_t{1} << 24;

using Bytes = std::vector<std::byte>;

class Out {
public:
    template <class T>
    void one(const T& value) {
        raw(&value, sizeof value);
    }
    template <class T>
    void all(const std::vector<T>& values) {
        raw(values.data(), values.size() * sizeof(T));
    }
    void grid(const TileGrid& g) { one(g.cells); }
    Bytes bytes;

private:
    void raw(const void* from, size_t count) {
        const auto* first = static_cast<const std::byte*>(from);
        bytes.insert(bytes.end(), first, first + count);
    }
};

/// Reads values whose sizes must fit exactly; after the first error nothing more is read.
class In {
public:
    /// `file`: which the bytes are in; null: in main memory.
    explicit In(std::span<const std::byte> bytes, std::shared_ptr<const FileMemory> file)
        : left_(bytes), file_(std::move(file)) {}
    template <class T>
    T one() {
        T value{};
        if (left_.size() < sizeof value)
            ok_ = false;
        else
            std::memcpy(&value, left_.data(), sizeof value), left_ = left_.subspan(sizeof value);
        return value;
    }
    template <class T>
    std::vector<T> all(uint64_t count) {
        if (!ok_ || count > left_.size() / sizeof(T)) {
            ok_ = false;
            return {};
        }
        std::vector<T> values(count);
        if (count != 0) std::memcpy(values.data(), left_.data(), count * sizeof(T));
        left_ = left_.subspan(count * sizeof(T));
        return values;
    }
    HeightTexels heights(uint64_t count) {
        if (!file_) return all<uint16_t>(count);
        if (!ok_ || count != left_.size() / sizeof(uint16_t)) {
            ok_ = false;
            return {};
        }
        // Chunks are on 64 bytes.
        const auto* first = reinterpret_cast<const uint16_t*>(left_.data());
        left_ = left_.subspan(count * sizeof(uint16_t));
        return {file_, std::span(first, count)};
    }
    TileGrid grid(glm::dvec3 extent) {
        const auto cells = one<glm::ivec3>();
        for (int axis = 0; axis < 3; ++axis) ok_ = ok_ && cells[axis] >= 1 && cells[axis] <= kMaxGridEdge;
        if (!ok_) return {};
        const TileGrid made(cells, extent);
        ok_ = made.count() <= kMaxGridCells;
        return made;
    }
    [[nodiscard]] bool done() const { return ok_ && left_.empty(); }
    void require(bool holds) { ok_ = ok_ && holds; }
    [[nodiscard]] bool ok() const { return ok_; }

private:
    std::span<const std::byte> left_;
    std::shared_ptr<const FileMemory> file_;
    bool ok_ = true;
};

void writeMap(const GdmMap& map, Out& o) {
    const DistanceTable& t = map.table;
    o.one(t.nodes), o.one(t.directions.thetas), o.one(t.directions.phis), o.one(t.unit);
    o.one(uint32_t(map.factors ? map.factors->rank : 0)), o.one(uint32_t(map.bits)),
        o.one(uint32_t(map.withVisibility));
    o.one(map.factors ? map.factors->unit : 0.0f);
    if (map.factors)
        o.all(map.factors->weights), o.all(map.factors->eigen);
    else
        o.all(t.steps);
    if (map.withVisibility) o.all(t.hits);
    o.all(map.properties.texels);
}

/// Reads a displacement map: of a whole slab, or from the top alone, where `map` has its curvatures and `layers` is
/// what its properties have along z. Sizes follow from its counts, and are those of the chunk.
void readMap(In& in, glm::dvec3 extent, int layers, GdmMap& map) {
    const bool isOfTop = layers > 0;
    const auto points = in.one<glm::ivec3>();
    DirectionGrid directions;
    directions.thetas = in.one<int>(), directions.phis = in.one<int>(), directions.downwards = isOfTop;
    const auto unit = in.one<float>();
    const auto rank = in.one<uint32_t>(), bits = in.one<uint32_t>(), withVisibility = in.one<uint32_t>();
    const auto factorUnit = in.one<float>();
    for (int axis = 0; axis < 2; ++axis) in.require(points[axis] >= 2 && points[axis] <= kMostNodes);
    in.require(isOfTop ? points.z == 1 : points.z >= 2 && points.z <= kMostNodes);
    in.require(directions.thetas >= 2 && directions.thetas <= 64 && directions.phis >= 4 && directions.phis <= 64);
    in.require(unit > 0 && unit <= 1 && std::abs(factorUnit) <= 1);
    in.require(rank <= uint32_t(kMostRank) && rank % 4 == 0 && (bits == 8 || bits == 16) && withVisibility <= 1);
    if (!in.ok()) return;
    map.table = DistanceTable{points, directions, map.table.curvatures, extent, unit, {}, {}};
    map.bits = int(bits), map.withVisibility = withVisibility == 1;
    const uint64_t rows = map.table.rows(), columns = map.table.columns(), words = uint64_t(rank / 4) * (bits / 8);
    if (rank == 0) {
        map.table.steps = in.all<uint16_t>(rows * columns);
    } else {
        map.factors = PackedFactors{rows, columns, int(rank), int(bits), factorUnit, {}, {}};
        map.factors->weights = in.all<uint32_t>(rows * words), map.factors->eigen = in.all<uint32_t>(columns * words);
    }
    if (map.withVisibility) map.table.hits = in.all<uint32_t>(rows * map.table.hitWords());
    const glm::ivec3 volume(points.x, points.y, isOfTop ? layers : points.z);
    map.properties = {volume, extent, in.all<uint32_t>(uint64_t(volume.x) * uint64_t(volume.y) * uint64_t(volume.z))};
}

constexpr uint32_t kViewDependentVersion = 1;

void writeViewDependent(const GdmMap& map, Out& o) {
    o.one(kViewDependentVersion), o.one(map.table.curvatures.samples), o.one(map.table.curvatures.most);
    o.one(map.properties.points.z);
    writeMap(map, o);
}

void readViewDependent(In& in, glm::dvec3 extent, GdmMap& map) {
    const auto version = in.one<uint32_t>();
    Curvatures& curvatures = map.table.curvatures;
    curvatures.samples = in.one<int>(), curvatures.most = in.one<double>();
    const auto layers = in.one<int>();
    in.require(version == kViewDependentVersion);
    in.require(curvatures.samples >= 1 && curvatures.samples <= kMostCurvatureSamples && curvatures.samples % 2 == 1);
    in.require(curvatures.samples == 1 || (curvatures.most > 0 && curvatures.most <= kMostCurvature));
    in.require(layers >= 2 && layers <= kMostNodes);
    if (in.ok()) readMap(in, extent, layers, map);
}

void readGuesses(In& in, SafeFactors& f) {
    f.cells = in.one<glm::ivec3>();
    f.azimuths = in.one<int>(), f.elevations = in.one<int>(), f.quads = in.one<int>(), f.clusters = in.one<int>();
    f.unit = in.one<float>(), f.product = in.one<float>();
    for (int axis = 0; axis < 3; ++axis) in.require(f.cells[axis] >= 1 && f.cells[axis] <= kMaxGridEdge);
    in.require(f.azimuths >= 1 && f.azimuths <= kMostAzimuths && f.elevations >= 1 && f.elevations <= kMostElevations);
    in.require(f.quads >= 1 && f.quads <= 4 && f.clusters >= 1 && f.clusters <= 256);
    in.require(f.unit >= 0 && f.unit <= 16 && f.product >= 0 && f.product <= 16);
    if (!in.ok()) return;
    f.rows = in.all<uint32_t>(4 * uint64_t(f.quads) * f.rowCount());
    f.columns = in.all<uint32_t>(4 * uint64_t(f.quads) * uint64_t(f.clusters) * f.columnCount());
    if (!in.ok()) return;
    for (size_t row = 0; row < f.rowCount(); ++row) in.require(f.rows[4 * row + 3] >> 16 < uint32_t(f.clusters));
}

constexpr uint32_t kTransferVersion = 1, kNormalsVersion = 1;

void writeTransfer(const TransferVolume& volume, Out& o) {
    o.grid(volume.grid), o.one(volume.albedo), o.one(volume.paths), o.one(uint32_t(volume.cells())),
        o.one(kTransferVersion), o.all(volume.numbers), o.all(volume.terms);
}

/// Whether 16 bits are a number.
bool isFiniteHalf(uint64_t bits) { return (bits & 0x7c00) != 0x7c00; }

std::shared_ptr<const TransferVolume> readTransfer(In& in, glm::dvec3 extent) {
    auto volume = std::make_shared<TransferVolume>();
    volume->grid = in.grid(extent), volume->albedo = in.one<float>(), volume->paths = in.one<uint32_t>();
    const auto cells = in.one<uint32_t>(), version = in.one<uint32_t>();
    in.require(volume->albedo >= 0 && volume->albedo <= 1 && version == kTransferVersion);
    in.require(cells <= TransferVolume::kMostCells);
    if (!in.ok()) return nullptr;
    volume->numbers = in.all<uint32_t>(volume->grid.count());
    volume->terms = in.all<uint64_t>(cells * TransferVolume::kTexels);
    uint32_t last = 0;
    for (const uint32_t number : volume->numbers)
        if (number != 0) in.require(number == ++last);
    in.require(last == cells);
    for (const uint64_t texel : volume->terms)
        for (int i = 0; i < 64; i += 16) in.require(isFiniteHalf(texel >> i));
    return volume;
}

/// What a chunk has: bytes of its own, then heights, which are the asset's.
struct ChunkContent {
    ChunkKind kind;
    Bytes bytes;
    HeightTexels heights = {};

    [[nodiscard]] uint64_t size() const { return bytes.size() + heights.size() * sizeof(uint16_t); }
};

/// Calls take(piece) -> Result<void> for bytes piece by piece. What was read of a file does not stay in main memory.
template <class Take>
Result<void> eachPiece(std::span<const std::byte> bytes, const auto& from, Take&& take) {
    for (size_t at = 0; at < bytes.size(); at += kPieceBytes) {
        VCP_TRY(take(bytes.subspan(at, std::min(kPieceBytes, bytes.size() - at))));
        from.letGo();
    }
    return {};
}

template <class Take>
Result<void> eachPiece(const ChunkContent& chunk, Take&& take) {
    VCP_TRY(take(std::span<const std::byte>(chunk.bytes)));
    return eachPiece(std::as_bytes(std::span(chunk.heights)), chunk.heights, take);
}

std::vector<ChunkContent> chunksOf(const Asset& a) {
    std::vector<ChunkContent> chunks;
    const auto add = [&](ChunkKind kind, const auto& write) {
        Out out;
        write(out);
        chunks.push_back({kind, std::move(out.bytes)});
    };
    if (a.heights) {
        add(ChunkKind::Heights, [&](Out& o) { o.one(a.heights->size), o.one(a.heights->range); });
        chunks.back().heights = a.heights->texels;
    }
    if (!a.solid.empty())
        add(ChunkKind::Solid, [&](Out& o) {
            o.one(a.seed), o.one(uint32_t(a.solid.size())), o.all(std::vector<char>(a.solid.begin(), a.solid.end()));
        });
    if (!a.triangles.empty()) add(ChunkKind::Triangles, [&](Out& o) { o.all(a.triangles); });
    if (a.field)
        add(ChunkKind::Field, [&](Out& o) { o.grid(a.field->grid), o.one(a.field->unit), o.all(a.field->steps); });
    if (a.occupancy) add(ChunkKind::Occupancy, [&](Out& o) { o.grid(a.occupancy->grid), o.all(a.occupancy->cells); });
    if (a.distances)
        add(ChunkKind::Distances, [&](Out& o) {
            o.grid(a.distances->grid), o.one(a.distances->cones.azimuth), o.one(a.distances->cones.elevation),
                o.one(a.distances->unit), o.all(a.distances->steps);
        });
    if (!a.factors.empty())
        add(ChunkKind::Compressed, [&](Out& o) { o.one(int32_t(a.factors.size())), o.all(a.factors); });
    if (a.boxes) add(ChunkKind::Boxes, [&](Out& o) { o.grid(a.boxes->grid), o.all(a.boxes->boxes); });
    if (a.patches)
        add(ChunkKind::Patches, [&](Out& o) {
            const PatchSet& p = *a.patches;
            o.grid(p.grid), o.one(uint32_t(p.ranks.size())), o.one(uint32_t(p.rows.size())),
                o.one(uint32_t(p.patches.size())), o.one(p.cellsWithout);
            o.all(p.ranks), o.all(p.rows), o.all(p.patches);
        });
    if (a.patches && !a.patches->normals.empty())
        add(ChunkKind::Normals, [&](Out& o) {
            o.one(kNormalsVersion), o.one(uint32_t(a.patches->normals.size())), o.all(a.patches->normals);
        });
    if (a.gdm) add(ChunkKind::Displacement, [&](Out& o) { writeMap(*a.gdm, o); });
    if (a.vdm) add(ChunkKind::ViewDependent, [&](Out& o) { writeViewDependent(*a.vdm, o); });
    if (a.guesses)
        add(ChunkKind::Guesses, [&](Out& o) {
            const SafeFactors& f = *a.guesses;
            o.one(f.cells), o.one(f.azimuths), o.one(f.elevations), o.one(f.quads), o.one(f.clusters), o.one(f.unit),
                o.one(f.product), o.all(f.rows), o.all(f.columns);
        });
    if (a.transfer) add(ChunkKind::Transfer, [&](Out& o) { writeTransfer(*a.transfer, o); });
    return chunks;
}

bool arePatchesSound(const PatchSet& p) {
    if (p.ranks.size() != (p.grid.count() + 31) / 32) return false;
    uint32_t rows = 0;
    for (size_t i = 0; i < p.ranks.size(); ++i) {
        if (p.ranks[i].base != rows) return false;
        rows += uint32_t(std::popcount(p.ranks[i].mask));
        if (i + 1 == p.ranks.size() && p.grid.count() % 32 != 0 && p.ranks[i].mask >> (p.grid.count() % 32) != 0)
            return false;
    }
    if (rows != p.rows.size()) return false;
    for (const uint32_t row : p.rows)
        if ((row & 15) == 0 || (row >> 4) + (row & 15) > p.patches.size()) return false;
    for (const Patch& patch : p.patches) {
        for (const float c : patch.quadric)
            if (!std::isfinite(c)) return false;
        for (int i = 0; i < 4; ++i)
            if (!std::isfinite(patch.u[i]) || !std::isfinite(patch.v[i])) return false;
        if (patch.isTriangle > 1) return false;
    }
    return true;
}

/// Reads one chunk. Returns false when the chunk is not what its kind says.
bool readChunk(ChunkKind kind, In& in, Asset& a) {
    const auto extent = a.extent;
    switch (kind) {
        case ChunkKind::Heights: {
            a.heights.emplace();
            a.heights->size = in.one<glm::ivec2>(), a.heights->range = in.one<double>();
            const glm::ivec2 size = a.heights->size;
            in.require(size.x >= 1 && size.y >= 1 && size.x <= kMaxMapEdge && size.y <= kMaxMapEdge &&
                       a.heights->extent() == extent);
            a.heights->texels = in.heights(in.ok() ? uint64_t(size.x) * uint64_t(size.y) : 0);
            break;
        }
        case ChunkKind::Solid: {
            a.seed = in.one<uint32_t>();
            const std::vector<char> name = in.all<char>(in.one<uint32_t>());
            a.solid.assign(name.begin(), name.end());
            in.require(makeSolid(a.solid, a.seed).ok());
            break;
        }
        case ChunkKind::Triangles:
            while (in.ok() && !in.done()) a.triangles.push_back(in.one<TileTriangle>());
            for (const TileTriangle& triangle : a.triangles)
                for (const glm::dvec3& p : triangle)
                    in.require(std::abs(p.x) <= 64 && std::abs(p.y) <= 64 && p.z >= 0 && p.z <= extent.z);
            break;
        case ChunkKind::Field: {
            a.field.emplace();
            a.field->grid = in.grid(extent), a.field->unit = in.one<float>();
            in.require(a.field->unit > 0 && std::isfinite(a.field->unit));
            const glm::ivec3 n = a.field->grid.cells;
            a.field->steps = in.all<int16_t>(uint64_t(n.x) * uint64_t(n.y) * uint64_t(n.z + 1));
            break;
        }
        case ChunkKind::Occupancy:
            a.occupancy.emplace();
            a.occupancy->grid = in.grid(extent);
            a.occupancy->cells = in.all<uint8_t>(a.occupancy->grid.count());
            break;
        case ChunkKind::Distances: {
            a.distances.emplace();
            a.distances->grid = in.grid(extent);
            a.distances->cones.azimuth = in.one<int>(), a.distances->cones.elevation = in.one<int>(),
            a.distances->unit = in.one<float>();
            const Cones cones = a.distances->cones;
            in.require(cones.azimuth >= 1 && cones.azimuth <= 32 && cones.elevation >= 1 && cones.elevation <= 16 &&
                       a.distances->unit > 0 && std::isfinite(a.distances->unit));
            a.distances->steps = in.all<uint8_t>(in.ok() ? a.distances->grid.count() * uint64_t(cones.count()) : 0);
            break;
        }
        case ChunkKind::Compressed: {
            const auto count = in.one<int32_t>();
            in.require(count >= 1 && count <= 6);
            a.factors = in.all<int>(in.ok() ? uint64_t(count) : 0);
            break;
        }
        case ChunkKind::Boxes:
            a.boxes.emplace();
            a.boxes->grid = in.grid(extent);
            a.boxes->boxes = in.all<uint16_t>(8 * a.boxes->grid.count());
            break;
        case ChunkKind::Patches: {
            a.patches.emplace();
            a.patches->grid = in.grid(extent);
            const auto ranks = in.one<uint32_t>(), rows = in.one<uint32_t>(), patches = in.one<uint32_t>();
            a.patches->cellsWithout = in.one<uint32_t>();
            a.patches->ranks = in.all<PatchSet::Rank>(ranks), a.patches->rows = in.all<uint32_t>(rows),
            a.patches->patches = in.all<Patch>(patches);
            in.require(in.ok() && arePatchesSound(*a.patches));
            break;
        }
        case ChunkKind::Normals: {
            const auto version = in.one<uint32_t>(), count = in.one<uint32_t>();
            in.require(version == kNormalsVersion && a.patches && count == a.patches->patches.size());
            if (in.ok()) a.patches->normals = in.all<PatchNormals>(count);
            break;
        }
        case ChunkKind::Displacement:
            readMap(in, extent, 0, a.gdm.emplace());
            break;
        case ChunkKind::ViewDependent:
            readViewDependent(in, extent, a.vdm.emplace());
            break;
        case ChunkKind::Guesses:
            readGuesses(in, a.guesses.emplace());
            break;
        case ChunkKind::Transfer:
            a.transfer = readTransfer(in, extent);
            break;
        default:
            return false;
    }
    return in.done();
}

/// Whether the chunks belong together: one source, grids that divide each other, maps that agree on the occupied cells.
bool belongTogether(Asset& a) {
    if (a.heights.has_value() + !a.solid.empty() + !a.triangles.empty() != 1) return false;
    if (!a.solid.empty() && makeSolid(a.solid, a.seed)->extent != a.extent) return false;
    const glm::ivec3 cells = a.occupancy ? a.occupancy->grid.cells : glm::ivec3(0);
    for (const TileGrid* grid : {a.distances ? &a.distances->grid : nullptr, a.boxes ? &a.boxes->grid : nullptr,
                                 a.patches ? &a.patches->grid : nullptr})
        if (grid != nullptr && grid->cells != cells) return false;
    if (a.occupancy && a.heights && (a.heights->size.x % cells.x != 0 || a.heights->size.y % cells.y != 0))
        return false;
    if (a.guesses && a.guesses->cells != cells) return false;
    if (a.occupancy && a.field && a.field->grid.cells % cells != glm::ivec3(0)) return false;
    const auto agrees = [&](size_t i, bool marked) {
        return marked == (a.occupancy->cells[i % a.occupancy->cells.size()] != 0);
    };
    if (a.distances)
        for (size_t i = 0; i < a.distances->steps.size(); ++i)
            if (!agrees(i, a.distances->steps[i] == kOccupied)) return false;
    if (a.boxes)
        for (size_t i = 0; i < a.boxes->boxes.size(); ++i)
            if (!agrees(i, a.boxes->boxes[i] >> 15)) return false;
    if (a.factors.empty()) return true;
    if (!a.distances) return false;
    auto compressed = compressMap(*a.distances, a.factors);
    if (!compressed) return false;
    a.compressed = *std::move(compressed);
    return true;
}

Result<GdmMap> mapOf(const Asset& asset, const Shape& shape, const AssetOptions::Displacement& options) {
    VCP_TRY_ASSIGN(auto table, traceTable(asset, shape, options.traced));
    VCP_TRY_ASSIGN(auto properties, sampleProperties(shape, options.traced.points));
    return packMap(std::move(table), options.rank, options.bits, options.withVisibility, std::move(properties));
}

uint64_t hashOf(std::span<const std::byte> bytes, const std::shared_ptr<const FileMemory>& file) {
    if (!file) return hashBytes(bytes);
    ContentHash hash;
    static_cast<void>(eachPiece(bytes, *file, [&](std::span<const std::byte> piece) {
        hash.add(piece);
        return Result<void>();
    }));
    return hash.value();
}

/// Reads an asset from bytes that may be hostile. `file`: which they are in; null: in main memory.
Result<Asset> parsed(std::span<const std::byte> bytes, const std::string& name,
                     const std::shared_ptr<const FileMemory>& file) {
    const auto fail = [&](const char* element, uint64_t byte, std::string message) {
        return Error{.code = ErrorCode::InvalidInput,
                     .message = std::move(message),
                     .file = name,
                     .element = element,
                     .byte = byte};
    };
    AssetHeader header;
    if (bytes.size() < sizeof header + sizeof(AssetCommit))
        return fail("header", bytes.size(),
                    bytes.empty() ? "the file is empty" : "the file is too short for a mesostructure asset");
    std::memcpy(&header, bytes.data(), sizeof header);
    if (std::memcmp(header.magic, AssetHeader{}.magic, 8) != 0)
        return fail("header", 0, "not a mesostructure asset; make one with `vcp meso build`");
    if (header.version != kAssetVersion)
        return Error{.code = ErrorCode::Unsupported,
                     .message = fmt::format("asset version {} is not known; this program reads version {}",
                                            header.version, kAssetVersion),
                     .file = name,
                     .element = "header",
                     .byte = 8};
    if (hashBytes(bytes.first(offsetof(AssetHeader, hash))) != header.hash || header.padding != 0)
        return fail("header", 0, "the header's hash does not match: the file was changed or damaged");
    if (header.fileBytes != bytes.size())
        return fail("header", 16,
                    fmt::format("the file should have {} bytes, it has {}", header.fileBytes, bytes.size()));
    if (header.chunks > kMaxChunks ||
        sizeof header + header.chunks * sizeof(AssetChunk) + sizeof(AssetCommit) > bytes.size())
        return fail("header", 12, "chunk count out of range");
    for (const double edge : header.extent)
        if (!(edge > 0) || !(edge <= 64)) return fail("header", 24, "the tile's extent is out of range");
    if (header.name[sizeof header.name - 1] != 0) return fail("header", 56, "the name does not end");

    AssetCommit commit;
    const uint64_t commitAt = bytes.size() - sizeof commit;
    std::memcpy(&commit, bytes.data() + commitAt, sizeof commit);
    if (std::memcmp(commit.magic, AssetCommit{}.magic, 8) != 0 || commit.fileBytes != bytes.size() ||
        commit.headerHash != header.hash ||
        commit.hash != hashBytes(bytes.subspan(commitAt, offsetof(AssetCommit, hash))))
        return fail("commit record", commitAt, "does not match the file: it was not finished, changed or damaged");

    std::vector<AssetChunk> table(header.chunks);
    const auto stored = bytes.subspan(sizeof header, table.size() * sizeof(AssetChunk));
    if (hashBytes(stored) != header.tableHash)
        return fail("chunk table", sizeof header, "hash does not match: the file was changed or damaged");
    if (!table.empty()) std::memcpy(table.data(), stored.data(), stored.size());
    Asset asset;
    asset.name = header.name;
    asset.extent = {header.extent[0], header.extent[1], header.extent[2]};
    uint64_t end = sizeof header + stored.size(), known = 0;
    for (const AssetChunk& chunk : table) {
        if (chunk.offset < end || chunk.offset - end >= kAlignment || chunk.offset % kAlignment != 0 ||
            chunk.bytes > commitAt || chunk.offset > commitAt - chunk.bytes)
            return fail("chunk table", sizeof header, "a chunk lies outside the file or overlaps another");
        for (uint64_t i = end; i < chunk.offset; ++i)
            if (bytes[i] != std::byte{0}) return fail("padding", i, "is not zero: the file was changed or damaged");
        const auto content = bytes.subspan(chunk.offset, chunk.bytes);
        if (hashOf(content, file) != chunk.hash)
            return fail("chunk", chunk.offset, "hash does not match: the file was changed or damaged");
        const auto kind = uint32_t(chunk.kind);
        if (kind >= 64 || kind == 0 || kind > uint32_t(ChunkKind::ViewDependent))
            return Error{.code = ErrorCode::Unsupported,
                         .message = fmt::format("chunk kind {} is not known: use a newer program", kind),
                         .file = name,
                         .element = "chunk table",
                         .byte = chunk.offset};
        if (known >> kind & 1) return fail("chunk table", chunk.offset, "two chunks of one kind");
        known |= uint64_t{1} << kind;
        In in(content, file);
        if (!readChunk(chunk.kind, in, asset))
            return fail("chunk", chunk.offset, fmt::format("chunk of kind {} is not what it says", kind));
        end = chunk.offset + chunk.bytes;
    }
    for (uint64_t i = end; i < commitAt; ++i)
        if (bytes[i] != std::byte{0}) return fail("padding", i, "is not zero: the file was changed or damaged");
    if (commitAt - end >= kAlignment) return fail("padding", end, "unexpected bytes before the commit record");
    if (!belongTogether(asset)) return fail("chunks", 0, "the chunks do not belong together");
    return asset;
}

}  // namespace

Result<std::unique_ptr<Shape>> shapeOf(const Asset& asset) {
    if (asset.heights) return heightShape(*asset.heights);
    if (!asset.solid.empty()) return solidShape(asset.solid, asset.seed);
    return meshShape(asset.triangles, asset.extent);
}

glm::ivec3 gridFor(const Asset& asset, glm::ivec3 asked) {
    if (asked.x > 0) return asked;
    int x = 64, y = std::max(1, int(std::lround(64 * asset.extent.y)));
    if (asset.heights) {
        // Returns the largest number of cells up to `most` that divides the texels.
        const auto part = [](int texels, int most) {
            for (int n = std::min(texels, most);; --n)
                if (texels % n == 0) return n;
        };
        x = part(asset.heights->size.x, 64), y = part(asset.heights->size.y, y);
    }
    return {x, y, std::clamp(int(std::ceil(asset.extent.z * x)), 4, 256)};
}

Result<void> buildAsset(Asset& asset, const AssetOptions& options) {
    VCP_TRY_ASSIGN(const auto shape, shapeOf(asset));
    asset.extent = shape->extent();
    const glm::ivec3 cells = gridFor(asset, options.cells);
    if (asset.heights && (asset.heights->size.x % cells.x != 0 || asset.heights->size.y % cells.y != 0))
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("a grid of {} x {} cells does not divide the height map's {} x {} texels",
                                            cells.x, cells.y, asset.heights->size.x, asset.heights->size.y)};
    if (options.samples < 1 || options.samples > 16)
        return Error{.code = ErrorCode::Usage, .message = "samples a cell must be from 1 to 16"};
    VCP_TRY_ASSIGN(auto occupancy, occupy(*shape, cells));
    if (!asset.heights) {
        VCP_TRY_ASSIGN(auto field, sampleField(*shape, cells * options.samples));
        occupyField(field, occupancy);
        asset.field = std::move(field);
    }
    asset.occupancy = std::move(occupancy);
    VCP_TRY_ASSIGN(auto distances, buildDistanceMap(*asset.occupancy, options.distances, shape.get()));
    asset.distances = std::move(distances);
    asset.factors = options.factors;
    if (!asset.factors.empty()) {
        VCP_TRY_ASSIGN(asset.compressed, compressMap(*asset.distances, asset.factors));
    }
    if (options.withBoxes) asset.boxes = buildOctantBoxes(*asset.occupancy);
    if (options.withGuesses) {
        VCP_TRY_ASSIGN(asset.guesses, buildGuesses(*asset.occupancy, options.guesses));
    }
    if (options.gdm) {
        VCP_TRY_ASSIGN(asset.gdm, mapOf(asset, *shape, *options.gdm));
    }
    if (options.vdm) {
        AssetOptions::Displacement map = *options.vdm;
        map.traced.ofTop = true;
        VCP_TRY_ASSIGN(asset.vdm, mapOf(asset, *shape, map));
    }
    if (options.transfer) {
        VCP_TRY_ASSIGN(auto transfer, traceTransfer(*shape, *options.transfer));
        asset.transfer = std::make_shared<const TransferVolume>(std::move(transfer));
    }
    if (!options.withPatches) return {};
    VCP_TRY_ASSIGN(asset.patches, buildPatches(*shape, *asset.occupancy, options.crossings));
    return {};
}

Result<uint64_t> writeAsset(const std::filesystem::path& path, const Asset& asset, const OutputRules& rules) {
    const auto chunks = chunksOf(asset);
    AssetHeader header;
    header.chunks = uint32_t(chunks.size());
    for (int axis = 0; axis < 3; ++axis) header.extent[axis] = asset.extent[axis];
    std::memcpy(header.name, asset.name.data(), std::min(asset.name.size(), sizeof header.name - 1));
    std::vector<AssetChunk> table(chunks.size());
    const auto aligned = [](uint64_t at) { return (at + kAlignment - 1) / kAlignment * kAlignment; };
    uint64_t end = aligned(sizeof header + table.size() * sizeof(AssetChunk));
    for (size_t i = 0; i < chunks.size(); ++i) {
        ContentHash hash;
        VCP_TRY(eachPiece(chunks[i], [&](std::span<const std::byte> piece) {
            hash.add(piece);
            return Result<void>();
        }));
        table[i] = {chunks[i].kind, 0, end, chunks[i].size(), hash.value()};
        end = aligned(end + chunks[i].size());
    }
    header.fileBytes = end + sizeof(AssetCommit);
    header.tableHash = hashBytes(std::as_bytes(std::span(table)));
    header.hash = hashBytes(std::as_bytes(std::span(&header, 1)).first(offsetof(AssetHeader, hash)));
    AssetCommit commit;
    commit.fileBytes = header.fileBytes, commit.headerHash = header.hash;
    commit.hash = hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(AssetCommit, hash)));

    VCP_TRY_ASSIGN(auto file, OutputFile::create(path, OutputKind::Asset, rules));
    if (::ftruncate(file.descriptor(), off_t(header.fileBytes)) != 0)
        return systemError(path, "cannot write here", errno);
    VCP_TRY(file.write(sizeof header, std::as_bytes(std::span(table))));
    for (size_t i = 0; i < chunks.size(); ++i) {
        uint64_t at = table[i].offset;
        VCP_TRY(eachPiece(chunks[i], [&](std::span<const std::byte> piece) {
            const uint64_t to = std::exchange(at, at + piece.size());
            return file.write(to, piece);
        }));
    }
    VCP_TRY(file.sync());
    VCP_TRY(file.write(0, std::as_bytes(std::span(&header, 1))));
    VCP_TRY(file.write(end, std::as_bytes(std::span(&commit, 1))));
    VCP_TRY(file.commit());
    return header.fileBytes;
}

Result<Asset> readAsset(const std::filesystem::path& path, const HeightStore& store) {
    VCP_TRY_ASSIGN(const auto reader, openFile(path));
    if (reader->size() > kMaxFileBytes)
        return Error{
            .code = ErrorCode::Limit, .message = "is larger than any mesostructure asset", .file = path.string()};
    // The header is read first, so that a large file of another kind is not read.
    if (reader->size() >= sizeof(AssetHeader)) {
        AssetHeader header;
        VCP_TRY(reader->read(0, std::as_writable_bytes(std::span(&header, 1))));
        if (std::memcmp(header.magic, AssetHeader{}.magic, 8) != 0)
            return Error{.message = "not a mesostructure asset; make one with `vcp meso build`",
                         .file = path.string(),
                         .element = "header",
                         .byte = 0};
    }
    if (reader->size() > store.mostInMemory * sizeof(uint16_t)) {
        VCP_TRY_ASSIGN(const auto file, FileMemory::copyOf(*reader, store.folder));
        return parsed(file->bytes(), path.string(), file);
    }
    Bytes bytes(reader->size());
    VCP_TRY(reader->read(0, bytes));
    return parseAsset(bytes, path.string());
}

Result<Asset> parseAsset(std::span<const std::byte> bytes, const std::string& name) {
    return parsed(bytes, name, nullptr);
}

}  // namespace vcp::meso
