#include "viewer/scene/base_light.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "builder/measure/mesh_bvh.h"
#include "octree/io/content_hash.h"
#include "octree/io/output_file.h"
#include "viewer/asset/share_out.h"
#include "viewer/scene/mesh_cache.h"

namespace vcp {

using meso::BaseHit, meso::BaseScene, meso::BaseSurface, meso::BaseTransfer, meso::BaseTransferOptions;
using meso::TilePaths, meso::TileReflection;

SceneBase sceneBase(BaseSurface surface, const meso::Shape& shape, double slab, double offset, double albedo) {
    const TileReflection tile = meso::tileReflection(TilePaths(shape, albedo));
    return {std::move(surface), offset + slab * tile.height / shape.extent().z, tile.albedo, false};
}

namespace {

namespace fs = std::filesystem;

using Ranges = std::vector<std::pair<uint32_t, uint32_t>>;
using Traced = std::vector<BaseTransfer>;

// A part of the key: it is raised when the same bases give another transfer.
constexpr uint64_t kGeneration = 1;
constexpr std::string_view kMagic = "vcplight";

/// A file of what was traced: the magic, the key, for each base the numbers of its vertices and of those with a change,
/// then BaseTransfer's arrays; the hash of all before.
class Bytes {
public:
    template <class T>
    void add(const std::vector<T>& values) {
        const auto bytes = std::as_bytes(std::span(values));
        all_.insert(all_.end(), bytes.begin(), bytes.end());
    }
    void add(uint64_t value) { add(std::vector{value}); }
    [[nodiscard]] uint64_t hash() const { return hashBytes(all_); }
    [[nodiscard]] std::span<const std::byte> all() const { return all_; }

private:
    std::vector<std::byte> all_;
};

uint64_t keyOf(const BaseScene& scene, const Ranges& ranges, const BaseTransferOptions& options) {
    Bytes bytes;
    for (const uint64_t number : {kGeneration, uint64_t{options.rays}, uint64_t{options.bounces}}) bytes.add(number);
    for (const auto& [first, count] : ranges) bytes.add(uint64_t{first} << 32 | count);
    bytes.add(scene.positions), bytes.add(scene.normals), bytes.add(scene.triangles), bytes.add(scene.albedos);
    return bytes.hash();
}

Bytes fileOf(const Traced& traced, uint64_t key) {
    Bytes bytes;
    bytes.add(std::vector(kMagic.begin(), kMagic.end()));
    bytes.add(key);
    for (const BaseTransfer& each : traced) {
        bytes.add(each.vertices()), bytes.add(each.changes.size() / BaseTransfer::kValues);
        bytes.add(each.numbers), bytes.add(each.changes);
    }
    bytes.add(bytes.hash());
    return bytes;
}

/// Takes values from the front of bytes; false where there are fewer.
template <class T>
bool take(std::span<const std::byte>& from, uint64_t count, std::vector<T>& values) {
    if (count > from.size() / sizeof(T)) return false;
    values.resize(count);
    std::memcpy(values.data(), from.data(), count * sizeof(T));
    from = from.subspan(count * sizeof(T));
    return true;
}

/// Reads what fileOf made; nothing where it is not whole, or of other bases.
std::optional<Traced> readTraced(const fs::path& path, uint64_t key, const Ranges& ranges) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> chars{std::istreambuf_iterator<char>(file), {}};
    std::span<const std::byte> bytes = std::as_bytes(std::span(chars));
    if (bytes.size() < kMagic.size() + 16) return std::nullopt;
    uint64_t hash = 0;
    std::memcpy(&hash, bytes.data() + bytes.size() - 8, 8);
    bytes = bytes.first(bytes.size() - 8);
    if (hashBytes(bytes) != hash) return std::nullopt;
    std::vector<char> magic;
    std::vector<uint64_t> numbers;
    if (!take(bytes, kMagic.size(), magic) || !std::ranges::equal(magic, kMagic) || !take(bytes, 1, numbers) ||
        numbers[0] != key)
        return std::nullopt;
    Traced traced;
    for (const auto& [first, count] : ranges) {
        BaseTransfer& made = traced.emplace_back();
        if (!take(bytes, 2, numbers) || numbers[0] != count || numbers[1] > count ||
            !take(bytes, count, made.numbers) || !take(bytes, numbers[1] * BaseTransfer::kValues, made.changes) ||
            std::ranges::any_of(made.numbers, [&](uint32_t number) { return number > numbers[1]; }))
            return std::nullopt;
    }
    return bytes.empty() ? std::optional(traced) : std::nullopt;
}

/// Traces what a scene asks for.
Result<Traced> trace(const BaseScene& scene, const Ranges& ranges, BaseTransferOptions options,
                     const std::function<bool(double)>& progress) {
    const IndexedMesh mesh{scene.positions, scene.triangles, {}};
    const MeshBvh bvh(mesh);
    options.cast = [&](glm::dvec3 origin, glm::dvec3 direction) -> std::optional<BaseHit> {
        const auto hit = bvh.nearestHit(origin, direction);
        if (!hit) return std::nullopt;
        return BaseHit{hit->triangle, hit->t};
    };
    options.shareOut = [&](size_t count, const auto& fill, BaseTransferOptions::Part of) {
        return shareOut(count, fill,
                        [&](double part) { return !progress || progress(glm::mix(of.before, of.after, part)); });
    };
    return meso::traceBaseTransfer(scene, ranges, options);
}

}  // namespace

Result<std::vector<std::shared_ptr<const BaseTransfer>>> traceBases(const std::vector<SceneBase>& bases,
                                                                    const fs::path& cache,
                                                                    const std::function<bool(double)>& progress) {
    BaseScene scene;
    Ranges ranges;
    for (const SceneBase& base : bases) {
        const uint32_t first = scene.add(base.surface, base.height, base.albedo);
        if (base.isAsked) ranges.emplace_back(first, uint32_t(base.surface.positions.size()));
    }
    std::vector<std::shared_ptr<const BaseTransfer>> made(bases.size());
    if (ranges.empty()) return made;
    const BaseTransferOptions options;
    const uint64_t key = keyOf(scene, ranges, options);
    const fs::path kept = cache.empty() ? fs::path() : cache / fmt::format("{:016x}{}", key, kBaseLightExtension);
    std::error_code ignored;
    auto traced = kept.empty() ? std::nullopt : readTraced(kept, key, ranges);
    if (traced) {
        fs::last_write_time(kept, fs::file_time_type::clock::now(), ignored);
    } else {
        VCP_TRY_ASSIGN(traced, trace(scene, ranges, options, progress));
        if (!kept.empty()) {
            fs::create_directories(cache, ignored);
            static_cast<void>(writeFile(kept, OutputKind::Text, fileOf(*traced, key).all(), {.overwrite = true}));
            MeshCache(cache).trim(kept);
        }
    }
    size_t next = 0;
    for (size_t i = 0; i < bases.size(); ++i)
        if (bases[i].isAsked) made[i] = std::make_shared<const BaseTransfer>(std::move((*traced)[next++]));
    return made;
}

}  // namespace vcp
