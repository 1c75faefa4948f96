// Frames of six models, as many as Wang et al. 2004 print rates of (their Fig. 7): time a covered pixel, and a prism.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "builder/measure/quantile.h"
#include "mesostructure/method.h"
#include "mesostructure/transfer_volume.h"
#include "render/environment_light.h"
#include "render/picture_renderer.h"
#include "viewer/asset/share_out.h"
#include "viewer/bench/bench_meso.h"
#include "viewer/scene/base_light.h"
#include "viewer/scene/meso_scene.h"

namespace vcp {

namespace {

using namespace meso;

/// A model of the paper, and what stands for it here: its mesostructure, the base that carries it, and how large.
struct Model {
    const char *asset, *base;
    double tiles;
    double triangles, localRate, globalRate;  ///< there: frames a second; 0: none is printed
};
constexpr std::array<Model, 6> kModels = {{{"weave", "teapot", 4, 4276, 56.0, 16.3},
                                           {"bars", "vase", 6, 8640, 71.3, 0},
                                           {"chain", "torus", 4, 4880, 40.8, 0},
                                           {"weave", "bird", 3, 11603, 46.4, 0},
                                           {"scales", "dinosaur", 4, 2142, 80.9, 0},
                                           {"bark", "tree", 1, 19618, 0, 9.1}}};
constexpr std::array<const char*, 2> kMethods = {"gdm", "boxes"};

/// A surface of Mehra and Kumar's Table 2, and times there: of a distance map, of directional distances and of these
/// with quadrics, over that of relief mapping.
struct TableSurface {
    const char* base;
    double distances, directional, quadrics;
};
constexpr std::array<TableSurface, 4> kSurfaces = {{{"quad", 0.38, 0.14, 0.34},
                                                    {"cylinder", 0.46, 0.10, 0.43},
                                                    {"teapot", 1.05, 0.42, 2.10},
                                                    {"box", 0.46, 0.23, 1.09}}};
constexpr const char* kReliefName = "relief-binary";

/// Returns the methods of that table, at its resolutions or in `cells` where these are not 0; relief mapping comes
/// first.
std::array<MethodOptions, 4> tableMethods(int cells = 0) {
    const auto orPrinted = [cells](int printed) { return cells != 0 ? cells : printed; };
    return {{{.name = kReliefName},
             {.name = "dm", .cells = orPrinted(128)},
             {.name = "ddm-compressed", .cells = orPrinted(128)},
             {.name = "ddm-quadric-fitted", .cells = orPrinted(16)}}};
}
constexpr const char* kSky = "studio";

/// A model that is drawn by one method, in one light.
struct Drawn {
    const Model* model;  ///< null: it is one of kSurfaces
    MesoModel row;
    std::unique_ptr<PictureRenderer> renderer;
    FrameRequest request;
    std::vector<double> ns;  ///< of a frame, of each round
};

/// What light from everywhere needs: the transfer of the asset and of its base.
struct Transferred {
    std::shared_ptr<const TransferVolume> volume;
    std::shared_ptr<const BaseTransfer> base;
};

using Progress = std::function<bool(const std::string& what, double part)>;

Result<Transferred> transferred(const Model& model, const MesoModelOptions& options) {
    VCP_TRY_ASSIGN(const auto asset, openMesoAsset(model.asset));
    VCP_TRY_ASSIGN(const auto shape, shapeOf(asset));
    VCP_TRY_ASSIGN(auto base, makeBaseSurface(model.base, model.tiles));
    const auto told = [&](double part) {
        return !options.progress || options.progress(fmt::format("light of {}", model.base), part);
    };
    const auto shared = [&](size_t count, const std::function<void(size_t, size_t)>& fill) {
        return shareOut(count, fill, told);
    };
    TransferOptions paths{.paths = options.paths, .shareOut = shared};
    if (options.cells != 0) paths.cells = options.cells;
    VCP_TRY_ASSIGN(auto volume, traceTransfer(*shape, paths));
    const double slab = tileEdge(base) * shape->extent().z;
    std::vector<SceneBase> bases{sceneBase(std::move(base), *shape, slab, 0, double(volume.albedo))};
    bases[0].isAsked = true;
    VCP_TRY_ASSIGN(const auto traced, traceBases(bases, {}, told));
    return Transferred{std::make_shared<const TransferVolume>(std::move(volume)), traced[0]};
}

/// What methods read of assets, made once for all bases and lights.
class AllArrays {
public:
    Result<std::shared_ptr<const MarchArrays>> of(const std::string& name, const Asset& asset, MethodOptions method,
                                                  const Progress& progress) {
        auto& made = made_[{name, method.name}];
        if (made) return made;
        VCP_TRY_ASSIGN(const auto shape, shapeOf(asset));
        method.shareOut = [&](size_t count, const std::function<void(size_t, size_t)>& fill) {
            return shareOut(count, fill,
                            [&](double part) { return !progress || progress("distances of " + name, part); });
        };
        VCP_TRY_ASSIGN(const auto built, buildMethod(asset, *shape, method));
        VCP_TRY_ASSIGN(auto arrays, built.arrays());
        return made = std::make_shared<const MarchArrays>(std::move(arrays));
    }

private:
    std::map<std::pair<std::string, std::string>, std::shared_ptr<const MarchArrays>> made_;
};

/// What is drawn: an asset on a base by a method.
struct Subject {
    std::string asset, base;
    double tiles = 4;
    MethodOptions method;
};

Result<Drawn> drawnBy(const Subject& subject, const Transferred* light, const MesoModelOptions& options,
                      AllArrays& arrays) {
    VCP_TRY_ASSIGN(const auto asset, openMesoAsset(subject.asset));
    VCP_TRY_ASSIGN(const auto base, makeBaseSurface(subject.base, subject.tiles));
    MesoSurface surface;
    VCP_TRY_ASSIGN(surface.arrays, arrays.of(subject.asset, asset, subject.method, options.progress));
    VCP_TRY_ASSIGN(surface.shell, buildShell(base, tileEdge(base) * asset.extent.z, asset.extent));
    surface.lift = shadowLift(*surface.arrays, tileEdge(base));
    Drawn drawn{.model = nullptr, .row = {}, .renderer = nullptr, .request = {}, .ns = {}};
    MesoModel& row = drawn.row;
    row.asset = subject.asset, row.base = subject.base, row.method = subject.method.name;
    row.light = light != nullptr ? "everywhere" : "local";
    row.prisms = base.triangles.size();
    FrameRequest& request = drawn.request;
    request.width = options.across, request.height = options.down;
    request.camera = fitCamera(surface.shell.low, surface.shell.high, glm::normalize(glm::dvec3(-0.5, 0.7, -0.4)),
                               {0, 0, 1}, 0.6, double(options.across) / options.down);
    if (light != nullptr) {
        surface.transfer = light->volume, surface.baseTransfer = light->base;
        request.shading.environment = environmentNamed(kSky);
        request.shading.environment->up = {0, 0, 1};
    } else {
        request.shading.lightFollowsCamera = false;
        request.shading.lightDirection = glm::normalize(glm::vec3(0.5f, -0.4f, 0.75f));
        request.shading.shadows = true;
    }
    VCP_TRY_ASSIGN(drawn.renderer, rendererOf(surface, options.device));
    return drawn;
}

Result<void> draw(Drawn& drawn, bool isCounted) {
    VCP_TRY_ASSIGN(const auto frame, timedFrame(*drawn.renderer, drawn.request));
    drawn.row.pixels = frame.stats.hitPixels, drawn.row.unresolved = frame.stats.unresolvedRays;
    drawn.row.device = drawn.renderer->device().name;
    if (isCounted) drawn.ns.push_back(frame.ns);
    return {};
}

/// Returns the median over the rounds of a frame's time over another's in the same round.
double ratioOf(const Drawn& of, const Drawn& over) {
    std::vector<double> ratios;
    for (size_t i = 0; i < of.ns.size(); ++i) ratios.push_back(of.ns[i] / over.ns[i]);
    return upperQuantile(ratios, 0.5);
}

/// Returns the model that is drawn by the same method in a light, or nothing.
const Drawn* found(const std::vector<Drawn>& all, std::string_view base, const std::string& method,
                   std::string_view light) {
    for (const Drawn& each : all)
        if (each.row.base == base && each.row.method == method && each.row.light == light) return &each;
    return nullptr;
}

void compareTable(const std::vector<Drawn>& all, std::vector<MesoPublished>& published) {
    for (const TableSurface& surface : kSurfaces) {
        const Drawn* relief = found(all, surface.base, kReliefName, "local");
        const auto add = [&](const char* method, double there) {
            if (const Drawn* of = found(all, surface.base, method, "local"); of != nullptr && relief != nullptr) {
                const double ours = ratioOf(*of, *relief);
                published.push_back({fmt::format("Table 2: frames of {} over relief mapping, {}", method, surface.base),
                                     of->row.asset, "time", there, there, ours, ours});
            }
        };
        const auto methods = tableMethods();
        add(methods[1].name.c_str(), surface.distances), add(methods[2].name.c_str(), surface.directional),
            add(methods[3].name.c_str(), surface.quadrics);
    }
}

void compareRates(const std::vector<Drawn>& all, std::vector<MesoPublished>& published) {
    for (const Drawn& each : all) {
        if (each.model == nullptr) continue;
        const Model &model = *each.model, &first = kModels[0];
        const bool isLocal = each.row.light == "local";
        const double rate = isLocal ? model.localRate : model.globalRate,
                     firstRate = isLocal ? first.localRate : first.globalRate;
        const Drawn* teapot = found(all, first.base, each.row.method, each.row.light);
        if (rate > 0 && teapot != nullptr && teapot != &each) {
            const double there = firstRate * first.triangles / (rate * model.triangles),
                         ours = ratioOf(each, *teapot) * double(teapot->row.prisms) / double(each.row.prisms);
            published.push_back({fmt::format("Wang Fig. 7: time a prism over the teapot's, {}, {}", model.base,
                                             isLocal ? "local light" : "global light"),
                                 fmt::format("{}, {}", model.asset, each.row.method), "time", there, there, ours,
                                 ours});
        }
        const Drawn* local = found(all, model.base, each.row.method, "local");
        if (!isLocal && local != nullptr && model.localRate > 0) {
            const double there = model.localRate / model.globalRate, ours = ratioOf(each, *local);
            published.push_back({fmt::format("Wang Fig. 7: time in global over local light, {}", model.base),
                                 fmt::format("{}, {}", model.asset, each.row.method), "time", there, there, ours,
                                 ours});
        }
    }
}

}  // namespace

Result<std::unique_ptr<PictureRenderer>> rendererOf(const MesoSurface& surface, const std::string& device) {
    RendererOptions options;
    options.device = device;
    VCP_TRY_ASSIGN(auto renderer, createPictureRenderer(options));
    VCP_TRY(renderer->setSurfaces(std::span(&surface, 1)));
    return renderer;
}

Result<TimedFrame> timedFrame(PictureRenderer& renderer, const FrameRequest& request) {
    VCP_TRY(renderer.update(request));
    const double start = processorNs();
    VCP_TRY_ASSIGN(const auto stats, renderer.render(request));
    return TimedFrame{stats, renderer.device().software ? processorNs() - start : 1e6 * stats.msFrame};
}

Result<std::vector<MesoModel>> compareMesoModels(const MesoModelOptions& options,
                                                 std::vector<MesoPublished>& published) {
    std::vector<Drawn> all;
    AllArrays arrays;
    for (size_t i = 0; i < kModels.size(); ++i) {
        const Model& model = kModels[i];
        const double part = double(i) / kModels.size();
        if (options.progress && !options.progress(model.base, part)) return Error::cancelled();
        Transferred light;
        if (model.globalRate > 0) {
            VCP_TRY_ASSIGN(light, transferred(model, options));
        }
        for (const char* name : kMethods)
            for (const Transferred* in :
                 {static_cast<const Transferred*>(nullptr), static_cast<const Transferred*>(&light)}) {
                if (in != nullptr && !light.volume) continue;
                MethodOptions method;
                method.name = name, method.cells = options.cells;
                VCP_TRY_ASSIGN(auto drawn,
                               drawnBy({model.asset, model.base, model.tiles, method}, in, options, arrays));
                drawn.model = &model;
                all.push_back(std::move(drawn));
            }
    }
    for (const TableSurface& surface : kSurfaces)
        for (const MethodOptions& method : tableMethods(options.cells)) {
            VCP_TRY_ASSIGN(auto drawn, drawnBy({"hemispheres", surface.base, 4, method}, nullptr, options, arrays));
            all.push_back(std::move(drawn));
        }
    // In rounds over all, so that whatever else the machine does falls on each; the first is a warm-up.
    for (int round = 0; round <= options.repetitions; ++round)
        for (Drawn& each : all) {
            if (options.progress && !options.progress("frames of models", double(round) / (options.repetitions + 1)))
                return Error::cancelled();
            VCP_TRY(draw(each, round > 0));
        }
    std::vector<MesoModel> rows;
    for (Drawn& each : all) {
        MesoModel& row = each.row;
        row.msFrame = 1e-6 * upperQuantile(each.ns, 0.5);
        row.nsPixel = 1e6 * row.msFrame / double(std::max<uint64_t>(row.pixels, 1));
        row.nsPrism = 1e6 * row.msFrame / double(row.prisms);
        rows.push_back(row);
    }
    compareTable(all, published);
    compareRates(all, published);
    return rows;
}

}  // namespace vcp
