#include "viewer/scene/scene_opening.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "octree/io/caught.h"
#include "streaming/caching_reader.h"
#include "streaming/http_reader.h"
#include "streaming/shard/shard_folder.h"
#include "streaming/web_address.h"
#include "viewer/scene/environment.h"

namespace vcp {

namespace {

// What is asked for first: of a manifest, in one request, all that a first picture needs of most; of a shard that a
// first picture does not need, little.
constexpr uint64_t kFirstOfManifest = 256 << 10, kFirstOfShard = 4 << 10;

/// Opens the file at an address, through the cache where one is asked for.
Result<std::shared_ptr<const ByteReader>> openRemote(const std::string& where, const SourceAccess& access,
                                                     const HttpOptions& options) {
    VCP_TRY_ASSIGN(auto http, HttpReader::open(where, options));
    if (access.cache.empty()) return std::shared_ptr<const ByteReader>(http);
    VCP_TRY_ASSIGN(auto cached, CachingReader::open(http, http->identity(), access.cache, access.cacheBytes));
    return std::shared_ptr<const ByteReader>(cached);
}

}  // namespace

Result<std::shared_ptr<const ByteReader>> openReader(const std::string& where, const SourceAccess& access) {
    if (!isHttpUrl(where)) return openDatasetFile(where);
    HttpOptions options;
    options.caFile = access.caFile;
    options.cancelled = access.cancelled;
    options.connections = sharedConnections();
    const uint64_t usual = options.firstBytes;
    if (where.find(kManifestName) != std::string::npos) options.firstBytes = kFirstOfManifest;
    VCP_TRY_ASSIGN(const auto file, openRemote(where, access, options));
    VCP_TRY_ASSIGN(const bool inShards, isManifest(*file));
    if (!inShards) return file;
    const auto openShard = [where, access, options, usual](const ShardRow& shard, bool isFirst,
                                                           const std::function<bool()>& cancelled) {
        HttpOptions ofShard = options;
        ofShard.firstBytes = isFirst ? usual : kFirstOfShard;
        ofShard.cancelled = [all = options.cancelled, cancelled] { return cancelled() || (all && all()); };
        return openRemote(addressBeside(where, shardName(shard)), access, ofShard);
    };
    VCP_TRY_ASSIGN(auto reader, ShardedReader::open(file, openShard));
    return std::shared_ptr<const ByteReader>(reader);
}

Box OpenDataset::bounds() const {
    const FileHeader& h = dataset->header;
    return {{h.boundsMin[0], h.boundsMin[1], h.boundsMin[2]}, {h.boundsMax[0], h.boundsMax[1], h.boundsMax[2]}};
}

Result<OpenDataset> openDataset(const std::string& where, const SourceAccess& access) {
    VCP_TRY_ASSIGN(auto reader, openReader(where, access));
    VCP_TRY_ASSIGN(auto dataset, readDatasetStart(*reader));
    OpenDataset open;
    open.isRemote = isHttpUrl(where);
    open.reader = reader;
    open.dataset = std::make_shared<const Dataset>(std::move(dataset));
    open.source = std::make_shared<const FilePageSource>(open.reader, open.dataset, open.runBytes());
    return open;
}

Box OpenedScene::bounds() const {
    Box all = surfaces.bounds;
    for (const Part& part : parts) all = all.joined(placedBox(part.open.bounds(), part.placement));
    return all;
}

LegendSubject OpenedScene::legendSubject() const {
    LegendSubject subject{.levels = {}, .hasRelief = !file.surfaces.empty()};
    for (const Part& part : parts) {
        const auto& header = part.open.dataset->header;
        subject.levels.push_back(header.method == Method::Paper ? 0 : header.levels);
    }
    return subject;
}

std::vector<PlacedDataset> OpenedScene::placed() const {
    std::vector<PlacedDataset> datasets;
    for (const Part& part : parts)
        datasets.push_back({part.open.dataset, part.open.source, part.placement, part.open.loaderThreads()});
    return datasets;
}

Result<OpenedScene> openScene(SceneFile file, const std::string& name,
                              const std::function<Result<OpenDataset>(const std::string& file)>& open, bool leavesOut,
                              const SurfaceProgress& progress) {
    OpenedScene scene;
    scene.file = std::move(file);
    std::vector<SceneDataset> kept;
    for (SceneDataset& each : scene.file.datasets) {
        auto opened = open(each.file);
        if (opened) {
            scene.parts.push_back({*std::move(opened), each.placement});
            kept.push_back(std::move(each));
            continue;
        }
        Error why = each.from.blamed(opened.error());
        if (!leavesOut || why.code == ErrorCode::Cancelled) return why;
        scene.leftOut.push_back({each.file, std::move(why)});
    }
    if (kept.empty() && !scene.leftOut.empty()) return scene.leftOut.front().why;
    scene.file.datasets = std::move(kept);
    VCP_TRY_ASSIGN(scene.surfaces, makeMesoScene(scene.file.surfaces, progress));
    if (scene.file.environment) {
        VCP_TRY_ASSIGN(scene.environment, openEnvironment(*scene.file.environment));
    }
    const Box all = scene.bounds();
    if (!std::isfinite(glm::length(all.high - all.low)))
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "the datasets lie too far apart to be shown together",
                     .file = shownAddress(name)};
    return scene;
}

void SurfaceChoices::applyTo(SceneFile& scene) const {
    for (MesoSurfaceDescription& surface : scene.surfaces) {
        if (!method.empty()) surface.method.name = method;
        if (subdivide) surface.subdivide = *subdivide;
        if (!withLightRays) surface.withLightRays = false;
    }
}

Result<OpenedScene> openScene(const std::vector<std::string>& inputs, const BuildOptions& build,
                              const SourceAccess& access, const SurfaceChoices& instead, bool leavesOut) {
    VCP_TRY_ASSIGN(const auto kind, kindOf(inputs));
    SceneFile file;
    if (kind == InputKind::Scene) {
        VCP_TRY_ASSIGN(file, readScene(inputs.front()));
        instead.applyTo(file);
    } else if (kind == InputKind::Datasets) {
        for (const std::string& input : inputs) file.datasets.push_back({input, {}});
    } else {
        VCP_TRY_ASSIGN(const auto path, datasetFor(inputs, build));
        file.datasets.push_back({path.string(), {}});
    }
    const auto count = double(file.datasets.size());
    double opened = 0;
    std::vector<std::filesystem::path> filesRead = filesOf(file);
    filesRead.insert(filesRead.end(), inputs.begin(), inputs.end());
    const auto addSideFiles = [&](const std::vector<std::string>& meshes) {
        const auto named = sideFilesOf(meshes, build);
        filesRead.insert(filesRead.end(), named.begin(), named.end());
    };
    if (kind == InputKind::Meshes) addSideFiles(inputs);
    const auto open = [&](const std::string& each) -> Result<OpenDataset> {
        if (build.progress && !build.progress({.stage = "opening", .fraction = opened++ / count}))
            return Error::cancelled();
        VCP_TRY_ASSIGN(const auto path, datasetFor({each}, build));
        addSideFiles({each});
        return openDataset(path.string(), access);
    };
    const auto told = [&](const char* stage, double part) {
        return !build.progress || build.progress({.stage = stage, .fraction = part});
    };
    auto scene = openScene(std::move(file), inputs.front(), open, leavesOut && kind == InputKind::Datasets, told);
    if (scene) scene->filesRead = std::move(filesRead);
    return scene;
}

std::string nameOf(const std::vector<std::string>& inputs) {
    if (inputs.empty()) return {};
    std::string first = std::filesystem::path(shownAddress(inputs.front())).filename().string();
    return inputs.size() == 1 ? first : fmt::format("{} and {} more", first, inputs.size() - 1);
}

SceneOpening::SceneOpening(std::vector<std::string> inputs, BuildOptions build, SourceAccess access)
    : inputs_(std::move(inputs)), build_(std::move(build)), access_(std::move(access)) {
    access_.cancelled = [token = cancelled_, others = access_.cancelled] { return *token || (others && others()); };
    thread_ = std::thread([this] {
        opened_ = caught([this] { return open(); }, nameOf(inputs_));
        done_ = true;
    });
}

SceneOpening::~SceneOpening() {
    // A dataset that was opened stays usable.
    if (!done_) cancel();
    thread_.join();
}

SceneOpening::Progress SceneOpening::progress() const {
    const std::lock_guard lock(mutex_);
    return progress_;
}

Result<OpenedScene> SceneOpening::take() { return *std::exchange(opened_, std::nullopt); }

Result<OpenedScene> SceneOpening::open() {
    // The display goes with the work: it is taken away before an error is shown.
    BuildOptions build = std::exchange(build_, {});
    const auto kind = kindOf(inputs_);
    if (kind && *kind == InputKind::Meshes) build.sample = sample_;
    build.progress = [this, told = std::move(build.progress)](const BuildProgress& at) {
        const bool goesOn = !told || told(at);
        const std::lock_guard lock(mutex_);
        progress_ = {at.stage, at.fraction, at.triangles, at.seconds, at.begun};
        return goesOn && !*cancelled_;
    };
    return openScene(inputs_, build, access_, {}, true);
}

}  // namespace vcp
