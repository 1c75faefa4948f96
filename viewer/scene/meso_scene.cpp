#include "viewer/scene/meso_scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <tuple>

#include <fmt/format.h>

#include "mesostructure/base/subdivision.h"
#include "mesostructure/base/surface_edges.h"
#include "mesostructure/remesh/certified_cells.h"
#include "mesostructure/solids.h"
#include "viewer/asset/height_image.h"
#include "viewer/asset/share_out.h"
#include "viewer/scene/base_light.h"
#include "viewer/scene/base_mesh.h"
#include "viewer/scene/mesh_cache.h"
#include "viewer/scene/tile_texture.h"

namespace vcp {

using namespace meso;

namespace {

constexpr int kTexels = 256;
// Levels of larger maps are averages: least volumes would take minutes.
constexpr size_t kMostFittedTexels = size_t{1} << 20;

Result<std::shared_ptr<const MarchArrays>> arraysOf(const Asset& asset, MethodOptions options,
                                                    const SurfaceProgress& progress) {
    options.shareOut = [&](size_t count, const auto& fill) {
        return shareOut(count, fill, [&](double part) { return !progress || progress("displacement map", part); });
    };
    VCP_TRY_ASSIGN(const auto shape, shapeOf(asset));
    VCP_TRY_ASSIGN(const auto method, buildMethod(asset, *shape, options));
    VCP_TRY_ASSIGN(auto arrays, method.arrays());
    return std::make_shared<const MarchArrays>(std::move(arrays));
}

Result<std::shared_ptr<const Appearance>> farOf(const Asset& asset, double heightScale) {
    VCP_TRY_ASSIGN(const auto shape, shapeOf(asset));
    return std::make_shared<const Appearance>(appearanceOf(*shape, heightScale));
}

/// Opens what a description names.
Result<Asset> openSource(const MesoSurfaceDescription& d) {
    if (d.displacement.empty()) return openMesoAsset(d.asset);
    Asset asset;
    asset.name = d.displacement;
    VCP_TRY_ASSIGN(asset.heights, readHeightImage(d.displacement, 1, heightStore()));
    asset.extent = asset.heights->extent();
    return asset;
}

/// Returns the name of what is opened.
const std::string& sourceOf(const MesoSurfaceDescription& d) {
    return d.displacement.empty() ? d.asset : d.displacement;
}

bool isFile(const MesoSurfaceDescription& d) {
    const auto names = baseSurfaceNames();
    return std::ranges::find(names, d.base) == names.end() && d.base.find('.') != std::string::npos;
}

Result<BaseSurface> baseOf(const MesoSurfaceDescription& d) {
    auto base = isFile(d) ? readBaseMesh(d.base, d.tiles) : makeBaseSurface(d.base, d.tiles);
    if (base && d.subdivide > 0) {
        base = subdivided(*base, d.subdivide);
        if (!base && isFile(d)) {
            Error error = base.error();
            error.file = d.base;
            return error;
        }
    }
    if (!base) return base;
    for (glm::dvec3& p : base->positions) p = d.place + d.scale * (isFile(d) ? p : turnedUp(p, d.up));
    return base;
}

using Texture = std::shared_ptr<const MesoTexture>;

/// Reads pictures; one that several surfaces name is read once.
class Textures {
public:
    Result<Texture> colours(const std::string& file) { return read(file, colours_, readColourTexture); }
    Result<Texture> normals(const std::string& file) { return read(file, normals_, readNormalTexture); }

private:
    using Known = std::map<std::string, Texture>;
    template <class Read>
    static Result<Texture> read(const std::string& file, Known& known, Read readTexture) {
        if (file.empty()) return Texture();
        Texture& texture = known[file];
        if (texture) return texture;
        VCP_TRY_ASSIGN(auto made, readTexture(file));
        return texture = std::make_shared<const MesoTexture>(std::move(made));
    }
    Known colours_, normals_;
};

/// Makes remeshed surfaces; the levels of a height field are made once.
class Remeshing {
public:
    /// Takes the asset's heights.
    Result<MesoSurface> make(const MesoSurfaceDescription& d, Asset& asset, const BaseSurface& base,
                             std::vector<std::string>& warnings, const SurfaceProgress& progress) {
        if (!asset.heights)
            return Error{.code = ErrorCode::Usage,
                         .message = fmt::format("{} is for height fields; {} is a solid", kRemeshMethod, asset.name)};
        if (!d.path.points.empty())
            return Error{.code = ErrorCode::Usage,
                         .message = fmt::format(
                             "{} draws nothing that moves: leave \"path\" out, or take another method", kRemeshMethod)};
        // Certified cells measure what averages leave out.
        const bool isLarge = asset.heights->texels.size() > kMostFittedTexels;
        const LevelFit fit = d.errorPixels > 0 || isLarge ? LevelFit::Averaged : LevelFit::Least;
        auto& [levels, arrays] = levels_[{sourceOf(d), d.withFilter, fit}];
        if (!levels) {
            if (d.withLightRays) arrays = castingArrays(*asset.heights);
            LevelFitOptions options{.fit = fit, .store = heightStore()};
            if (!d.withFilter) options.mostLevels = 1;
            VCP_TRY_ASSIGN(auto made, HeightLevels::build(std::move(*asset.heights), options));
            levels = std::make_shared<const HeightLevels>(std::move(made));
        }
        const double edge = tileEdge(base), height = d.heightScale * edge * asset.extent.z;
        auto made = buildRemeshSurface(base, levels, height, d.offset * d.scale);
        if (!made) {
            Error error = made.error();
            if (isFile(d)) error.file = d.base;
            return error;
        }
        MesoSurface surface;
        surface.remeshed = {std::make_shared<const RemeshSurface>(*std::move(made)),
                            {.cell = d.cell,
                             .errorPixels = d.errorPixels,
                             .shareOut = [](size_t count, const std::function<void(size_t first, size_t last)>& fill) {
                                 return shareOut(count, fill, {});
                             }}};
        if (d.errorPixels > 0) {
            auto cells = CertifiedCells::create(*surface.remeshed.surface, [&](double part) {
                return !progress || progress("cutting the surface", part);
            });
            if (!cells) return cells.error();
            surface.remeshed.cells = std::make_shared<CertifiedCells>(*std::move(cells));
        }
        surface.withBase = d.withBase;
        if (!d.withLightRays) return surface;
        auto shell =
            arrays
                ? buildShell(base, height, asset.extent, d.offset * d.scale)
                : Error{.message = fmt::format("rays are marched over at most {} texels along an edge", kMaxGridEdge)};
        if (!shell) {
            warnings.push_back(fmt::format("{} casts no shadows: {}", sourceOf(d), shell.error().message));
            return surface;
        }
        surface.arrays = arrays, surface.shell = *std::move(shell), surface.lift = shadowLift(*arrays, edge);
        return surface;
    }

private:
    /// Returns what rays of light march; null where the map has too many texels for rays.
    static std::shared_ptr<const MarchArrays> castingArrays(const HeightMap& map) {
        if (std::max(map.size.x, map.size.y) > kMaxGridEdge) return nullptr;
        return std::make_shared<const MarchArrays>(pyramidArrays(map));
    }

    struct Made {
        std::shared_ptr<const HeightLevels> levels;
        std::shared_ptr<const MarchArrays> arrays;
    };
    std::map<std::tuple<std::string, bool, LevelFit>, Made> levels_;
};

using Transfer = std::shared_ptr<const TransferVolume>;

/// Returns what an asset holds of light, where a description asks for it. Errors: Usage.
Result<Transfer> transferOf(const MesoSurfaceDescription& d, const Asset& asset) {
    if (!d.withTransfer) return Transfer();
    const auto refused = [](std::string message) {
        return Error{.code = ErrorCode::Usage, .message = std::move(message)};
    };
    if (d.method.name == kRemeshMethod)
        return refused(fmt::format("{} takes no transfer: leave it out, or take another method", kRemeshMethod));
    if (d.heightScale != 1)
        return refused("transfer holds for the asset's own height: leave \"height\" out, or make a higher asset");
    if (!asset.transfer)
        return refused(fmt::format("{} holds no transfer: make an asset with it, by `vcp meso build`", sourceOf(d)));
    return asset.transfer;
}

/// The bases of a scene, whose surfaces shade each other in light from everywhere. What moves does not take part.
class SceneBases {
public:
    explicit SceneBases(std::span<const MesoSurfaceDescription> descriptions)
        : isAsked_(std::ranges::any_of(descriptions, isAsking)) {}

    Result<void> add(const MesoSurfaceDescription& d, const Asset& asset, BaseSurface base, Transfer transfer) {
        if (!isAsked_ || !d.path.points.empty()) return {};
        VCP_TRY_ASSIGN(const auto shape, shapeOf(asset));
        const double slab = d.heightScale * tileEdge(base) * asset.extent.z,
                     albedo = transfer ? double(transfer->albedo) : TransferOptions().albedo;
        bases_.push_back(sceneBase(std::move(base), *shape, slab, d.offset * d.scale, albedo));
        bases_.back().isAsked = isAsking(d);
        return {};
    }
    /// Gives its transfer to each surface that asks for it. Errors: Cancelled.
    Result<void> trace(std::span<const MesoSurfaceDescription> descriptions, MesoScene& scene,
                       const SurfaceProgress& progress) const {
        if (bases_.empty()) return {};
        const auto cache = defaultCacheFolder();
        const auto traced = traceBases(bases_, cache ? *cache : std::filesystem::path(),
                                       [&](double part) { return !progress || progress("light of bases", part); });
        if (!traced) {
            if (traced.error().code == ErrorCode::Cancelled) return traced.error();
            scene.warnings.push_back(traced.error().message + "; the bases do not shade each other");
            return {};
        }
        size_t next = 0;
        for (size_t i = 0; i < descriptions.size(); ++i)
            if (descriptions[i].path.points.empty()) scene.surfaces[i].baseTransfer = (*traced)[next++];
        return {};
    }

private:
    static bool isAsking(const MesoSurfaceDescription& d) {
        return d.withTransfer && d.withBaseTransfer && d.path.points.empty();
    }
    bool isAsked_;
    std::vector<SceneBase> bases_;
};

void warn(const MesoSurfaceDescription& d, const BaseSurface& base, const Shell& shell,
          std::vector<std::string>& warnings) {
    if (const auto edges = isFile(d) ? edgesOf(base) : SurfaceEdges(); !edges) {
        Error error = edges.error();
        error.file = d.base;
        warnings.push_back(error.line() + "; it is drawn as it is");
    }
    const auto say = [&](uint64_t count, const char* what) {
        if (count > 0) warnings.push_back(fmt::format("{}: {} {}", d.base, count, what));
    };
    say(shell.withoutArea, "triangles without area are left out");
    say(shell.withoutMap, "triangles whose texture coordinates have no area: the mesostructure is smeared there");
    say(shell.flat, "pieces of the shell have no volume and are left out: faces on their own backs have no outside");
    say(shell.cut,
        "columns of the shell are cut: the surface bends more sharply inwards than the mesostructure is high");
    say(shell.inverted, "pieces of the shell are turned inside out: the surface folds there");
}

}  // namespace

double SurfacePath::period() const {
    if (points.empty()) return 0;
    return points.front() == points.back() ? seconds : 2 * seconds;
}

glm::dvec3 SurfacePath::at(double time) const {
    double length = 0;
    for (size_t i = 1; i < points.size(); ++i) length += glm::distance(points[i - 1], points[i]);
    const double along = std::fmod(time, period()) / seconds;
    double left = length * (along > 1 ? 2 - along : along);
    for (size_t i = 1; i < points.size(); ++i) {
        const double step = glm::distance(points[i - 1], points[i]);
        if (left < step) return glm::mix(points[i - 1], points[i], left / step);
        left -= step;
    }
    return points.back();
}

double periodOf(std::span<const SurfacePath> paths) {
    double longest = 0;
    for (const SurfacePath& path : paths) longest = std::max(longest, path.period());
    return longest;
}

std::vector<glm::dvec3> surfacesMovedAt(std::span<const SurfacePath> paths, double time) {
    std::vector<glm::dvec3> moved;
    if (periodOf(paths) == 0) return moved;
    for (const SurfacePath& path : paths) moved.push_back(path.points.empty() ? glm::dvec3(0) : path.at(time));
    return moved;
}

Error ScenePlace::blamed(Error error) const {
    if (file.empty() || error.code != ErrorCode::Usage) return error;
    const std::string about = error.file.empty() ? std::string() : error.file + ": ";
    return {.code = ErrorCode::InvalidInput,
            .message = (key.empty() ? "" : fmt::format("\"{}\": ", key)) + about + error.message,
            .file = file,
            .element = fmt::format("line {}", line)};
}

HeightStore heightStore() {
    HeightStore store;
    const auto cache = defaultCacheFolder();
    std::error_code failed;
    if (cache) std::filesystem::create_directories(*cache, failed);
    if (cache && !failed) store.folder = *cache;
    return store;
}

Result<Asset> openMesoAsset(const std::string& name) {
    Asset asset;
    const auto isIn = [&](const auto& names) { return std::ranges::find(names, name) != names.end(); };
    asset.name = name;
    if (isIn(heightFieldNames())) {
        VCP_TRY_ASSIGN(asset.heights, makeHeightField(name, kTexels, 1));
    } else if (isIn(solidNames())) {
        asset.solid = name, asset.seed = 1;
    } else {
        if (!name.ends_with(".meso"))
            return Error{.code = ErrorCode::Usage,
                         .message = fmt::format(
                             "\"{}\" is neither a procedural height field or solid nor an asset (.meso)", name)};
        return readAsset(name, heightStore());
    }
    VCP_TRY_ASSIGN(const auto shape, shapeOf(asset));
    asset.extent = shape->extent();
    return asset;
}

Result<MesoScene> makeMesoScene(std::span<const MesoSurfaceDescription> descriptions, const SurfaceProgress& progress) {
    MesoScene scene;
    Textures textures;
    Remeshing remeshing;
    std::map<std::pair<std::string, double>, std::shared_ptr<const Appearance>> appearances;
    std::map<std::string, Transfer> transfers;  // an asset is read once for each surface, and kept once
    SceneBases bases(descriptions);
    for (const MesoSurfaceDescription& d : descriptions) {
        const double part = double(scene.paths.size()) / double(descriptions.size());
        if (progress && !progress("mesostructure", part)) return Error::cancelled();
        SurfacePath& path = scene.paths.emplace_back(d.path);
        for (glm::dvec3& point : path.points) point -= d.place;
        auto asset = openSource(d);
        if (!asset) return d.from.blamed(asset.error());
        const auto base = baseOf(d);
        if (!base) return d.from.blamed(base.error());
        const auto transfer = transferOf(d, *asset);
        if (!transfer) return d.from.blamed(transfer.error());
        VCP_TRY(bases.add(d, *asset, *base, *transfer));
        if (d.method.name == kRemeshMethod) {
            auto surface = remeshing.make(d, *asset, *base, scene.warnings, progress);
            if (!surface) return d.from.blamed(surface.error());
            VCP_TRY_ASSIGN(surface->colours, textures.colours(d.colourTexture));
            VCP_TRY_ASSIGN(surface->normals, textures.normals(d.normalTexture));
            surface->colour = d.colour;
            const RemeshSurface& made = *surface->remeshed.surface;
            scene.bounds = scene.bounds.joined({made.low, made.high});
            scene.surfaces.push_back(*std::move(surface));
            continue;
        }
        auto arrays = arraysOf(*asset, d.method, progress);
        if (!arrays) {
            Error error = arrays.error();
            if (error.code == ErrorCode::Cancelled) return error;
            if (error.file.empty() && error.code != ErrorCode::Usage) error.file = sourceOf(d);
            return d.from.blamed(std::move(error));
        }
        const double edge = tileEdge(*base);
        auto shell = buildShell(*base, d.heightScale * edge * asset->extent.z, asset->extent, d.offset * d.scale);
        if (!shell) {
            Error error = shell.error();
            if (isFile(d)) error.file = d.base;
            return d.from.blamed(std::move(error));
        }
        warn(d, *base, *shell, scene.warnings);
        scene.bounds = scene.bounds.joined({shell->low, shell->high});
        for (const glm::dvec3& moved : path.points)
            scene.bounds = scene.bounds.joined({shell->low + moved, shell->high + moved});
        MesoSurface surface;
        auto colours = textures.colours(d.colourTexture), normals = textures.normals(d.normalTexture);
        for (const auto* texture : {&colours, &normals})
            if (!*texture) return texture->error();
        surface.colours = *std::move(colours), surface.normals = *std::move(normals);
        surface.lift = shadowLift(**arrays, edge);
        if (*transfer) surface.transfer = transfers.try_emplace(sourceOf(d), *transfer).first->second;
        if (d.withFar && !*transfer) {
            auto& far = appearances[{sourceOf(d), d.heightScale}];
            if (!far) {
                VCP_TRY_ASSIGN(far, farOf(*asset, d.heightScale));
            }
            surface.far = far;
        }
        surface.arrays = *std::move(arrays), surface.shell = *std::move(shell), surface.colour = d.colour,
        surface.withBase = d.withBase;
        scene.surfaces.push_back(std::move(surface));
    }
    VCP_TRY(bases.trace(descriptions, scene, progress));
    return scene;
}

}  // namespace vcp
