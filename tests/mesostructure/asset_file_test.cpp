// Assets: what was written is read back, and every changed, cut or lying byte is refused.
#include "mesostructure/asset_file.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <random>

#include <sys/stat.h>
#include <unistd.h>

#include "mesostructure/method.h"
#include "octree/io/content_hash.h"
#include "tests/support/meso_rays.h"
#include "tests/support/test_folder.h"

namespace vcp::meso {
namespace {

using Bytes = std::vector<std::byte>;

Bytes bytesOf(const std::filesystem::path& path) {
    const std::string text = contentOf(path);
    Bytes bytes(text.size());
    std::memcpy(bytes.data(), text.data(), text.size());
    return bytes;
}

Asset small(const std::string& solid) {
    Asset asset;
    asset.name = "small";
    asset.solid = solid;
    const auto built =
        buildAsset(asset, {.cells = {8, 8, 2}, .samples = 1, .distances = {.cones = {2, 1}}, .factors = {2}});
    EXPECT_TRUE(built.ok()) << built.error().line();
    return asset;
}

TEST(AssetFile, GivesBackWhatWasWritten) {
    const TestFolder folder("meso_asset_test");
    for (int kind = 0; kind < 3; ++kind) {
        Asset asset;
        asset.name = "one";
        if (kind == 0) asset.heights = *makeHeightField("fbm", 32, 5);
        if (kind == 1) asset.solid = "beads", asset.seed = 9;
        if (kind == 2) {
            // A box of twelve triangles, normals outwards.
            const auto corner = [](int i) {
                return glm::dvec3(i & 1 ? 0.7 : 0.3, i & 2 ? 0.7 : 0.3, i & 4 ? 0.2 : 0.1);
            };
            for (const auto& [a, b, c, d] : std::initializer_list<std::array<int, 4>>{
                     {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
                asset.triangles.push_back({corner(a), corner(b), corner(c)});
                asset.triangles.push_back({corner(a), corner(c), corner(d)});
            }
            asset.extent = {1, 1, 0.25};
        }
        const auto built = buildAsset(asset, {.cells = {16, 16, 4}});
        ASSERT_TRUE(built.ok()) << built.error().line();
        const auto bytes = writeAsset(folder / "a.meso", asset);
        ASSERT_TRUE(bytes.ok()) << bytes.error().line();
        EXPECT_EQ(*bytes, std::filesystem::file_size(folder / "a.meso"));
        EXPECT_FALSE(std::filesystem::exists(folder / "a.meso.partial"));
        const auto read = readAsset(folder / "a.meso");
        ASSERT_TRUE(read.ok()) << read.error().line();
        EXPECT_EQ(read->distances->steps, asset.distances->steps);
        EXPECT_EQ(read->boxes->boxes, asset.boxes->boxes);
        EXPECT_EQ(read->patches->rows, asset.patches->rows);
        EXPECT_EQ(read->patches->normals, asset.patches->normals);
        EXPECT_EQ(read->patches->normals.size(), read->patches->patches.size());
        EXPECT_EQ(read->triangles, asset.triangles);
        EXPECT_EQ(read->compressed->bytes(), asset.compressed->bytes());
        EXPECT_EQ(read->heights ? read->heights->texels : HeightTexels(),
                  asset.heights ? asset.heights->texels : HeightTexels());
        // The same again, byte for byte.
        ASSERT_TRUE(writeAsset(folder / "b.meso", *read).ok());
        EXPECT_EQ(contentOf(folder / "a.meso"), contentOf(folder / "b.meso"));
    }
}

Asset withMap(int rank, bool withVisibility) {
    Asset asset;
    asset.name = asset.solid = "ball";
    AssetOptions options{.cells = {8, 8, 2}, .samples = 1, .distances = {.cones = {2, 1}}, .factors = {}};
    options.withBoxes = options.withPatches = false;
    options.withGuesses = true;
    options.guesses = {.clusters = 3, .rounds = 1};
    options.gdm = {.traced = {.points = {5, 4, 3}, .directions = {4, 6}},
                   .rank = rank,
                   .bits = rank == 8 ? 8 : 16,
                   .withVisibility = withVisibility};
    options.vdm = options.gdm;
    options.vdm->traced.curvatures = {rank == 4 ? 1 : 3, 0.4};
    options.vdm->withVisibility = options.vdm->traced.curvatures.samples > 1;
    const auto built = buildAsset(asset, options);
    EXPECT_TRUE(built.ok()) << built.error().line();
    return asset;
}

TEST(AssetFile, DisplacementMapsAndGuessesComeBack) {
    const TestFolder folder("meso_asset_gdm_test");
    for (const auto& [rank, withVisibility] : {std::pair{0, true}, {4, false}, {8, true}}) {
        const Asset asset = withMap(rank, withVisibility);
        ASSERT_TRUE(writeAsset(folder / "a.meso", asset).ok());
        const auto read = readAsset(folder / "a.meso");
        ASSERT_TRUE(read.ok()) << read.error().line();
        EXPECT_EQ(read->gdm->bytes(), asset.gdm->bytes());
        EXPECT_EQ(read->gdm->table.steps, asset.gdm->table.steps);
        EXPECT_EQ(read->gdm->table.hits, asset.gdm->table.hits);
        EXPECT_EQ(read->gdm->properties.texels, asset.gdm->properties.texels);
        EXPECT_EQ(read->guesses->rows, asset.guesses->rows);
        EXPECT_EQ(read->guesses->columns, asset.guesses->columns);
        if (rank > 0) {
            EXPECT_EQ(read->gdm->factors->weights, asset.gdm->factors->weights);
        }
        EXPECT_EQ(read->vdm->bytes(), asset.vdm->bytes());
        EXPECT_EQ(read->vdm->table.steps, asset.vdm->table.steps);
        EXPECT_EQ(read->vdm->table.nodes, glm::ivec3(5, 4, 1));
        EXPECT_EQ(read->vdm->table.curvatures, asset.vdm->table.curvatures);
        EXPECT_EQ(read->vdm->table.directions.direction(0, 0), asset.vdm->table.directions.direction(0, 0));
        EXPECT_EQ(read->vdm->properties.texels, asset.vdm->properties.texels);
        // A method without a size of its own takes what is stored.
        const auto shape = *shapeOf(*read);
        const auto method = buildMethod(*read, *shape, {.name = "gdm"});
        ASSERT_TRUE(method) << method.error().line();
        EXPECT_EQ(method->gdm->table.nodes, glm::ivec3(5, 4, 3));
        const auto ofTop = buildMethod(*read, *shape, {.name = "vdm"});
        ASSERT_TRUE(ofTop) << ofTop.error().line();
        EXPECT_EQ(ofTop->gdm->table.curvatures, asset.vdm->table.curvatures);
        const auto safe = buildMethod(*read, *shape, {.name = "gdm-safe"});
        ASSERT_TRUE(safe) << safe.error().line();
        EXPECT_EQ(safe->guesses->rows, asset.guesses->rows);
        ASSERT_TRUE(writeAsset(folder / "b.meso", *read).ok());
        EXPECT_EQ(contentOf(folder / "a.meso"), contentOf(folder / "b.meso"));
    }
}

/// With right hashes all over, as a liar writes them.
void resign(Bytes& bytes) {
    AssetHeader header;
    std::memcpy(&header, bytes.data(), sizeof header);
    std::vector<AssetChunk> table(header.chunks);
    std::memcpy(table.data(), bytes.data() + sizeof header, table.size() * sizeof(AssetChunk));
    for (AssetChunk& chunk : table) chunk.hash = hashBytes(std::span(bytes).subspan(chunk.offset, chunk.bytes));
    std::memcpy(bytes.data() + sizeof header, table.data(), table.size() * sizeof(AssetChunk));
    header.tableHash = hashBytes(std::as_bytes(std::span(table)));
    header.hash = hashBytes(std::as_bytes(std::span(&header, 1)).first(offsetof(AssetHeader, hash)));
    std::memcpy(bytes.data(), &header, sizeof header);
    AssetCommit commit;
    std::memcpy(&commit, bytes.data() + bytes.size() - sizeof commit, sizeof commit);
    commit.headerHash = header.hash;
    commit.hash = hashBytes(std::as_bytes(std::span(&commit, 1)).first(offsetof(AssetCommit, hash)));
    std::memcpy(bytes.data() + bytes.size() - sizeof commit, &commit, sizeof commit);
}

Asset withTransfer() {
    Asset asset;
    asset.name = asset.solid = "ball";
    AssetOptions options{.cells = {4, 4, 1}, .samples = 1, .distances = {.cones = {1, 1}}, .factors = {}};
    options.withBoxes = options.withPatches = false;
    options.transfer = TransferOptions{.cells = 4, .albedo = 0.7, .paths = 8};
    const auto built = buildAsset(asset, options);
    EXPECT_TRUE(built.ok()) << built.error().line();
    return asset;
}

TEST(AssetFile, TransferComesBackAndItsLiesAreRefusedOrHarmless) {
    const TestFolder folder("meso_asset_transfer_test");
    const Asset asset = withTransfer();
    ASSERT_TRUE(writeAsset(folder / "a.meso", asset).ok());
    Bytes bytes = bytesOf(folder / "a.meso");
    const auto read = parseAsset(bytes, "a");
    ASSERT_TRUE(read.ok()) << read.error().line();
    EXPECT_EQ(read->transfer->numbers, asset.transfer->numbers);
    EXPECT_EQ(read->transfer->terms, asset.transfer->terms);
    EXPECT_EQ(read->transfer->albedo, 0.7f);
    EXPECT_EQ(read->transfer->paths, 8u);
    for (size_t bit = 0; bit < bytes.size() * 8; ++bit) {
        bytes[bit / 8] ^= std::byte(1 << bit % 8);
        ASSERT_FALSE(parseAsset(bytes, "a").ok()) << "bit " << bit;
        bytes[bit / 8] ^= std::byte(1 << bit % 8);
    }
    std::mt19937 random(8);
    int refused = 0;
    for (int i = 0; i < 2000; ++i) {
        Bytes changed = bytes;
        const size_t first = 256 + 48 * 5, at = first + random() % (changed.size() - first - 64);
        const uint32_t value = i % 3 == 0 ? 0xffffffffu : i % 3 == 1 ? uint32_t(random()) : uint32_t(random() % 40);
        std::memcpy(changed.data() + at, &value, std::min<size_t>(4, changed.size() - 64 - at));
        resign(changed);
        const auto lie = parseAsset(changed, "lie");
        refused += !lie.ok();
        if (!lie) continue;
        // Whatever it says, look-ups stay in memory and are numbers.
        const TransferReader reader(*lie->transfer);
        std::uniform_real_distribution<double> unit(0, 1);
        for (int k = 0; k < 5; ++k)
            for (const float c : reader.at({unit(random), unit(random), 0.2 * unit(random)}, {0, 0, 1}).c)
                ASSERT_TRUE(std::isfinite(c));
    }
    EXPECT_GT(refused, 300);
}

TEST(AssetFile, EveryTruncationAndEveryFlippedBitIsRefused) {
    const TestFolder folder("meso_asset_damage_test");
    Asset asset = small("ball");
    asset.boxes.reset();
    ASSERT_TRUE(writeAsset(folder / "a.meso", asset).ok());
    Bytes bytes = bytesOf(folder / "a.meso");
    ASSERT_TRUE(parseAsset(bytes, "a").ok());
    for (size_t size = 0; size < bytes.size(); ++size)
        ASSERT_FALSE(parseAsset(std::span(bytes).first(size), "a").ok()) << size;
    for (size_t bit = 0; bit < bytes.size() * 8; ++bit) {
        bytes[bit / 8] ^= std::byte(1 << bit % 8);
        ASSERT_FALSE(parseAsset(bytes, "a").ok()) << "bit " << bit;
        bytes[bit / 8] ^= std::byte(1 << bit % 8);
    }
    bytes.push_back(std::byte{0});
    EXPECT_FALSE(parseAsset(bytes, "a").ok());
}

TEST(AssetFile, LiesBehindValidHashesAreRefusedOrHarmless) {
    const TestFolder folder("meso_asset_lies_test");
    const Asset asset = small("ball");
    ASSERT_TRUE(writeAsset(folder / "a.meso", asset).ok());
    const Bytes bytes = bytesOf(folder / "a.meso");
    std::mt19937 random(6);
    int refused = 0;
    for (int i = 0; i < 3000; ++i) {
        Bytes changed = bytes;
        // Within chunks: behind the header and the table.
        const size_t first = 256 + 48 * 8, at = first + random() % (changed.size() - first - 64);
        const uint32_t value = i % 3 == 0 ? 0xffffffffu : uint32_t(random());
        std::memcpy(changed.data() + at, &value, std::min<size_t>(4, changed.size() - 64 - at));
        resign(changed);
        const auto read = parseAsset(changed, "lie");
        refused += !read.ok();
        if (!read) continue;
        // Whatever it says, walks end and stay in memory.
        const auto marcher = gridMarcher({.compressed = &*read->compressed}, {.patches = &*read->patches});
        ASSERT_TRUE(marcher.ok());
        for (int k = 0; k < 5; ++k) static_cast<void>((*marcher)->march(test::rayFromTop(random, read->extent)));
    }
    EXPECT_GT(refused, 300);
}

/// Patches had no normals at first.
TEST(AssetFile, PatchesWithoutNormalsOpenAndStaySo) {
    const TestFolder folder("meso_asset_normals_test");
    Asset asset = small("ball");
    const uint64_t with = *writeAsset(folder / "with.meso", asset);
    asset.patches->normals.clear();
    EXPECT_LT(*writeAsset(folder / "without.meso", asset), with);
    const auto read = readAsset(folder / "without.meso");
    ASSERT_TRUE(read.ok()) << read.error().line();
    EXPECT_EQ(read->patches->patches.size(), asset.patches->patches.size());
    EXPECT_TRUE(read->patches->normals.empty());
    EXPECT_EQ(gridArrays({.occupancy = &*read->occupancy}, {.patches = &*read->patches})->record.patchNormals, 0u);
    ASSERT_TRUE(writeAsset(folder / "again.meso", *read).ok());
    EXPECT_EQ(contentOf(folder / "without.meso"), contentOf(folder / "again.meso"));
}

/// Normals of another version, of other patches or before them are refused in one line.
TEST(AssetFile, NormalsThatAreNotOfThePatchesAreRefused) {
    const TestFolder folder("meso_asset_normals_lies_test");
    ASSERT_TRUE(writeAsset(folder / "a.meso", small("ball")).ok());
    const Bytes bytes = bytesOf(folder / "a.meso");
    AssetHeader header;
    std::memcpy(&header, bytes.data(), sizeof header);
    std::vector<AssetChunk> table(header.chunks);
    std::memcpy(table.data(), bytes.data() + sizeof header, table.size() * sizeof(AssetChunk));
    const auto normals = std::ranges::find(table, ChunkKind::Normals, &AssetChunk::kind);
    ASSERT_NE(normals, table.end());
    const auto refused = [&](size_t at, uint32_t value) {
        Bytes changed = bytes;
        std::memcpy(changed.data() + at, &value, sizeof value);
        resign(changed);
        const auto read = parseAsset(changed, "lie");
        EXPECT_FALSE(read.ok());
        if (!read.ok()) {
            EXPECT_EQ(read.error().line().find('\n'), std::string::npos);
        }
    };
    refused(normals->offset, 2);
    refused(normals->offset + 4, uint32_t(normals->bytes / sizeof(PatchNormals)) - 1);
    refused(normals->offset + 4, 0xffffffffu);
    // The patches' chunk becomes one of normals, so these have no patches.
    const auto patches = std::ranges::find(table, ChunkKind::Patches, &AssetChunk::kind);
    refused(sizeof header + size_t(patches - table.begin()) * sizeof(AssetChunk), uint32_t(ChunkKind::Guesses));
}

TEST(AssetFile, LiesOfMapsAreRefusedOrHarmless) {
    const TestFolder folder("meso_asset_map_lies_test");
    for (const int rank : {0, 4, 8}) {
        ASSERT_TRUE(writeAsset(folder / "a.meso", withMap(rank, true)).ok());
        const Bytes bytes = bytesOf(folder / "a.meso");
        std::mt19937 random(7);
        int refused = 0;
        for (int i = 0; i < 1500; ++i) {
            Bytes changed = bytes;
            const size_t first = 256 + 48 * 7, at = first + random() % (changed.size() - first - 64);
            const uint32_t value = i % 3 == 0 ? 0xffffffffu : i % 3 == 1 ? uint32_t(random()) : uint32_t(random() % 40);
            std::memcpy(changed.data() + at, &value, std::min<size_t>(4, changed.size() - 64 - at));
            resign(changed);
            const auto read = parseAsset(changed, "lie");
            refused += !read.ok();
            if (!read) continue;
            const auto marcher = gdmMarcher(*read->gdm);
            ASSERT_TRUE(marcher.ok());
            const auto ofTop = gdmMarcher(*read->vdm);
            ASSERT_TRUE(ofTop.ok());
            const OctantBoxes boxes = buildOctantBoxes(*read->occupancy);
            const auto safe =
                gridMarcher({.boxes = &boxes, .guesses = &*read->guesses, .mostGuesses = 3}, {.field = &*read->field});
            ASSERT_TRUE(safe.ok());
            for (int k = 0; k < 5; ++k) {
                MarchRay ray = test::rayFromTop(random, read->extent);
                static_cast<void>((*marcher)->march(ray)), static_cast<void>((*safe)->march(ray));
                ray.bend = k - 2;
                static_cast<void>((*ofTop)->march(ray));
            }
        }
        EXPECT_GT(refused, 20) << rank;
    }
}

/// Large heights stay in a file: of the same bytes, and hostile ones are refused alike.
TEST(AssetFile, HeightsThatStayInAFileAreTheSame) {
    const TestFolder folder("meso_asset_file_test");
    Asset asset;
    asset.name = "large";
    asset.heights = *makeHeightField("fbm", 64, 5);
    asset.extent = asset.heights->extent();
    ASSERT_TRUE(writeAsset(folder / "a.meso", asset).ok());
    const HeightStore inFiles{.folder = folder.path(), .mostInMemory = 100};
    const auto read = readAsset(folder / "a.meso", inFiles);
    ASSERT_TRUE(read.ok()) << read.error().line();
    EXPECT_TRUE(read->heights->texels.areInFile());
    EXPECT_FALSE(readAsset(folder / "a.meso")->heights->texels.areInFile());
    ASSERT_TRUE(writeAsset(folder / "b.meso", *read).ok());
    EXPECT_EQ(contentOf(folder / "a.meso"), contentOf(folder / "b.meso"));
    const Bytes whole = bytesOf(folder / "a.meso");
    std::filesystem::resize_file(folder / "a.meso", 0);
    read->heights->texels.letGo();
    EXPECT_EQ(read->heights->texels, asset.heights->texels) << "what became of the file does not matter";
    const auto put = [&](const Bytes& bytes) {
        std::ofstream(folder / "x.meso", std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
        return readAsset(folder / "x.meso", inFiles);
    };
    for (size_t i = 0; i < whole.size(); i += 97) {
        Bytes changed = whole;
        changed[i] ^= std::byte{4};
        const auto inFile = put(changed), inMemory = parseAsset(changed, (folder / "x.meso").string());
        ASSERT_EQ(inFile.ok(), inMemory.ok()) << i;
        if (!inFile.ok()) {
            EXPECT_EQ(inFile.error().line(), inMemory.error().line());
        }
    }
    for (const size_t kept : {size_t{300}, size_t{400}, whole.size() / 2, whole.size() - 1})
        EXPECT_FALSE(put(Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(kept))).ok()) << kept;
}

TEST(AssetFile, OtherFilesAreToldApart) {
    const TestFolder folder("meso_asset_other_test");
    const auto says = [&](const std::string& text) {
        std::ofstream(folder / "x", std::ios::binary) << text;
        return readAsset(folder / "x").error();
    };
    EXPECT_NE(says("").message.find("empty"), std::string::npos);
    EXPECT_NE(says("short").message.find("short"), std::string::npos);
    EXPECT_NE(says(std::string(5000, 'x')).message.find("not a mesostructure asset"), std::string::npos);
    EXPECT_EQ(says("").file, (folder / "x").string());
    EXPECT_EQ(readAsset(folder / "nothing").error().code, ErrorCode::Io);
    EXPECT_EQ(writeAsset(folder.path(), small("ball")).error().code, ErrorCode::Io);
    EXPECT_EQ(writeAsset(folder / "no/such/place.meso", small("ball")).error().code, ErrorCode::Io);

    ASSERT_TRUE(writeAsset(folder / "a.meso", small("ball")).ok());
    Bytes bytes = bytesOf(folder / "a.meso");
    bytes[8] = std::byte{2};
    resign(bytes);
    EXPECT_EQ(parseAsset(bytes, "newer").error().code, ErrorCode::Unsupported);
}

TEST(AssetFile, BuildingRefusesWhatDoesNotFit) {
    Asset asset;
    asset.heights = *makeHeightField("fbm", 30, 1);
    EXPECT_EQ(buildAsset(asset, {.cells = {16, 16, 4}}).error().code, ErrorCode::Usage);
    EXPECT_TRUE(buildAsset(asset, {}).ok()) << "a grid that divides the texels is found";
    asset.heights->texels = {};
    EXPECT_FALSE(buildAsset(asset, {}).ok());
    Asset unknown;
    unknown.solid = "nothing";
    EXPECT_FALSE(buildAsset(unknown, {}).ok());
}

}  // namespace
}  // namespace vcp::meso
