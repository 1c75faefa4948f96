// The mesostructure asset, a .meso file, version 1: what a mesostructure is and what was built from it.
//
//   offset   bytes     content
//   0        256       AssetHeader
//   256      48 * n    table of n chunks: AssetChunk
//   ...                chunks, each on 64 bytes, zero bytes between; plain arrays, as a GPU reads them
//   end-64   64        AssetCommit, written last
//
// The same rules as a .vcp (octree/vcp_file.h): an XXH3-64 for header, table and each chunk; sizes, counts and indices
// are checked before use, so a hostile file wastes neither memory nor time; readers refuse versions and chunks that
// they do not know; written as OUT.partial, made durable, renamed: OUT is whole or absent. Little endian. The same
// asset gives the same bytes.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mesostructure/march.h"
#include "mesostructure/transfer_volume.h"
#include "octree/io/output_file.h"

namespace vcp::meso {

inline constexpr uint32_t kAssetVersion = 1;

/// What a chunk holds; new methods add kinds.
enum class ChunkKind : uint32_t {
    Heights = 1,     ///< HeightMap: 2 x i32 size, f64 range, u16 texels
    Solid = 2,       ///< u32 seed, u32 length, the name's bytes
    Triangles = 3,   ///< 9 doubles a triangle, tile space
    Field = 4,       ///< SampledField: grid, f32 unit, i16 steps
    Occupancy = 5,   ///< grid, u8 cells
    Distances = 6,   ///< DistanceMap: grid, 2 x i32 cones, f32 unit, u8 steps
    Boxes = 7,       ///< OctantBoxes: grid, u16 boxes
    Patches = 8,     ///< PatchSet: grid, 3 x u32 counts, u32 cells without, ranks, rows, patches
    Compressed = 9,  ///< i32 number of factors and the factors; made again from Distances on reading
    /// GdmMap: 3 x i32 points, 2 x i32 directions, f32 unit, u32 rank (0: the table), u32 bits, u32 with visibility,
    /// f32 unit of the factors; u16 steps, or u32 weights and eigen-maps; u32 hits; u32 properties
    Displacement = 10,
    /// SafeFactors: grid, i32 azimuths, elevations, quads, clusters, f32 unit, product, u32 rows, columns
    Guesses = 11,
    /// TransferVolume: grid, f32 albedo, u32 paths a cell, u32 number of the last cell, u32 version (1); u32 numbers,
    /// terms of 4 x u16
    Transfer = 12,
    /// PatchSet::normals, behind the patches: u32 version (1), u32 number of patches, 4 x u32 a patch
    Normals = 13,
    /// GdmMap of the top alone: u32 version (1), i32 samples of curvature, f64 the greatest, i32 points of the
    /// properties along z; the rest as Displacement, with one point along z
    ViewDependent = 14,
};

struct AssetHeader {
    char magic[8] = {'V', 'C', 'P', 'm', 'e', 's', 'o', '\n'};
    uint32_t version = kAssetVersion;
    uint32_t chunks = 0;
    uint64_t fileBytes = 0;
    double extent[3] = {};  ///< tile units
    uint64_t tableHash = 0;
    char name[64] = {};  ///< name of what it was made of, ends with 0
    uint8_t reserved[120] = {};
    uint64_t hash = 0;     ///< XXH3-64 of the bytes before
    uint64_t padding = 0;  ///< 0
};
static_assert(sizeof(AssetHeader) == 256 && offsetof(AssetHeader, extent) == 24 && offsetof(AssetHeader, name) == 56 &&
              offsetof(AssetHeader, hash) == 240);

struct AssetChunk {
    ChunkKind kind{};
    uint32_t reserved = 0;
    uint64_t offset = 0, bytes = 0, hash = 0;
    uint64_t unused[2] = {};
};
static_assert(sizeof(AssetChunk) == 48);

struct AssetCommit {
    char magic[8] = {'M', 'E', 'S', 'O', 'c', 'm', 'm', 't'};
    uint64_t fileBytes = 0;
    uint64_t headerHash = 0;
    uint64_t reserved[4] = {};
    uint64_t hash = 0;  ///< XXH3-64 of the 56 bytes before
};
static_assert(sizeof(AssetCommit) == 64);

/// One of the three sources, and what was built from it.
struct Asset {
    std::string name;
    std::optional<HeightMap> heights;
    std::string solid;  ///< procedural: its name
    uint32_t seed = 0;
    std::vector<TileTriangle> triangles;
    glm::dvec3 extent{0};

    std::optional<SampledField> field;  ///< samples of a solid or a mesh
    std::optional<Occupancy> occupancy;
    std::optional<DistanceMap> distances;
    std::vector<int> factors;  ///< blocks of the compressed map; empty: none
    std::optional<CompressedMap> compressed;
    std::optional<OctantBoxes> boxes;
    std::optional<PatchSet> patches;
    std::optional<GdmMap> gdm, vdm;  ///< the latter of the top alone
    std::optional<SafeFactors> guesses;
    std::shared_ptr<const TransferVolume> transfer;  ///< null: none
};

/// Returns the asset's shape, which refers to the asset. Errors: as the shapes'.
Result<std::unique_ptr<Shape>> shapeOf(const Asset& asset);

struct AssetOptions {
    glm::ivec3 cells{
        0};           ///< grid cells; 0: 64 along x (a height map's edge or a half, third... of it), cubes otherwise
    int samples = 2;  ///< samples of a solid's field a cell, along each axis: 1 to 16
    DistanceOptions distances = {.cones = {4, 2}};
    std::vector<int> factors = {4};
    CrossingRule crossings = CrossingRule::Direct;
    bool withBoxes = true, withPatches = true;
    bool withGuesses = false;  ///< for gdm-safe
    SafeOptions guesses = {};

    /// A displacement map, where there is to be one.
    struct Displacement {
        GdmOptions traced;
        int rank = 16, bits = 16;
        bool withVisibility = true;
    };
    std::optional<Displacement> gdm = std::nullopt;
    std::optional<Displacement> vdm = std::nullopt;  ///< of the top alone; `ofTop` is not read
    std::optional<TransferOptions> transfer = std::nullopt;
};

/// Returns cells that suit an asset, where `asked` is 0.
glm::ivec3 gridFor(const Asset& asset, glm::ivec3 asked);

/// Fills in what is built from the source. Errors: as the builders'.
Result<void> buildAsset(Asset& asset, const AssetOptions& options);

/// Writes an asset and returns the file's bytes. Errors: Io.
Result<uint64_t> writeAsset(const std::filesystem::path& path, const Asset& asset, const OutputRules& rules = {});
/// Reads an asset; heights that are many stay in a file of the store. Errors: Io; InvalidInput, Unsupported with file,
/// element and byte.
Result<Asset> readAsset(const std::filesystem::path& path, const HeightStore& store = {});
/// Reads an asset from bytes that may be hostile; `name` is the file's name in errors.
Result<Asset> parseAsset(std::span<const std::byte> bytes, const std::string& name);

}  // namespace vcp::meso
