// Light from everywhere on a tile, and on base surfaces that shade themselves: what transfer gives, and what four bands
// of light can give, against a path tracer under the surroundings themselves.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/shell_paths.h"
#include "mesostructure/tile_paths.h"
#include "render/environment_light.h"
#include "render/host_renderer.h"
#include "viewer/asset/share_out.h"
#include "viewer/bench/bench_meso.h"
#include "viewer/bench/picture/flip.h"
#include "viewer/scene/base_light.h"
#include "viewer/scene/meso_scene.h"

namespace vcp {

namespace {

using namespace meso;
using glm::dvec3;

constexpr int kPixels = 64;              // an edge of the picture, which shows one tile
constexpr int kAcross = 96, kDown = 72;  // the picture of a base
constexpr uint32_t kPaths = 1024;        // of a pixel of the tile; half of them of the base
constexpr double kDark = 0.01;           // what a light of 0 counts in relative errors
constexpr double kGrey = 0.6;            // of the surface, encoded
const dvec3 kView(0.5, -0.5, std::sqrt(0.5));
constexpr size_t kSkies = kEnvironmentNames.size();

using Lights = std::array<dvec3, kSkies>;

/// What a pixel gets of each sky: by the path tracer, by its transfer of four bands, by the volume, and if it were
/// open.
struct Pixel {
    bool isSeen = false;
    Lights truth{}, bands{}, volume{}, open{};
};

struct Sky {
    std::function<dvec3(dvec3)> radiance;
    std::array<glm::vec3, 16> light;
};

template <class Values>
dvec3 lightOf(const Values& transfer, const Sky& sky) {
    dvec3 light(0);
    for (size_t i = 0; i < 16; ++i) light += double(transfer[i]) * dvec3(sky.light[i]);
    return glm::max(light, dvec3(0));
}

using Layer = std::vector<dvec3>;

Layer layerOf(std::span<const Pixel> pixels, Lights Pixel::*of, size_t sky) {
    Layer layer;
    for (const Pixel& pixel : pixels) layer.push_back((pixel.*of)[sky]);
    return layer;
}

ColourPicture pictureOf(glm::ivec2 size, const Layer& light) {
    ColourPicture picture{size.x, size.y, {}};
    for (const dvec3 l : light) picture.pixels.push_back(glm::min(kGrey * glm::pow(l, dvec3(1 / 2.2)), dvec3(1)));
    return picture;
}

/// Compares the light that pixels get with what they should, where `isSeen` says so; elsewhere both are 0.
MesoLight compared(glm::ivec2 size, const Layer& light, const Layer& truth, const std::vector<bool>& isSeen) {
    MesoLight made;
    double sum = 0, sumTrue = 0, relative = 0, differences = 0, count = 0;
    const std::vector<double> different = flip(pictureOf(size, truth), pictureOf(size, light));
    for (size_t i = 0; i < light.size(); ++i) {
        if (!isSeen[i]) continue;
        ++count;
        differences += different[i];
        for (int c = 0; c < 3; ++c) {
            const double is = light[i][c], should = truth[i][c];
            relative += (is - should) * (is - should) / (should * should + kDark);
            sum += is, sumTrue += should;
        }
    }
    made.relativeMse = relative / (3 * count);
    made.energy = sum / sumTrue;
    made.flipMean = differences / count;
    return made;
}

/// Follows paths from what a pixel shows, for its truth and its transfer of four bands.
template <class Follow>
void followPaths(const TilePoint& point, const Follow& follow, std::span<const Sky> skies, uint32_t count,
                 size_t number, Pixel& pixel) {
    PathRandom random(number);
    const glm::dvec2 shift(random.next(), random.next());
    std::array<double, 16> transfer{};
    for (uint32_t i = 0; i < count; ++i) {
        glm::dvec2 p = evenPoint(i) + shift;
        p -= glm::floor(p);
        const TileEscape escape = follow(point, directionByCosine(point.normal, p), random);
        if (escape.weight <= 0) continue;
        const meso::f64::Harmonics from = meso::f64::harmonicsOf(escape.direction);
        for (size_t k = 0; k < 16; ++k) transfer[k] += escape.weight * from.c[k] / count;
        for (size_t s = 0; s < kSkies; ++s)
            pixel.truth[s] += escape.weight * skies[s].radiance(escape.direction) / double(count);
    }
    for (size_t s = 0; s < kSkies; ++s) pixel.bands[s] = lightOf(transfer, skies[s]);
}

Pixel pixelOf(const TilePaths& paths, const TransferReader& reader, std::span<const Sky> skies, size_t number) {
    Pixel pixel;
    const dvec3 extent = paths.shape().extent();
    const glm::dvec2 place((double(number % kPixels) + 0.5) / kPixels * extent.x,
                           (double(number / kPixels) + 0.5) / kPixels * extent.y);
    const TileMeeting seen = paths.see(kView, place);
    if (seen.kind != TileMeeting::Kind::Surface) return pixel;
    pixel.isSeen = true;
    const auto follow = [&](const TilePoint& from, dvec3 towards, PathRandom& random) {
        return paths.follow(from, towards, random);
    };
    followPaths(seen.point, follow, skies, kPaths, number, pixel);
    const meso::f32::Harmonics stored = reader.at(seen.point.at, seen.point.normal);
    const meso::f64::Harmonics open = meso::f64::clampedCosine(seen.point.normal);
    for (size_t s = 0; s < kSkies; ++s) {
        pixel.volume[s] = lightOf(stored.c, skies[s]);
        pixel.open[s] = lightOf(open.c, skies[s]);
    }
    return pixel;
}

std::vector<Sky> allSkies() {
    std::vector<Sky> skies;
    for (const char* name : kEnvironmentNames)
        skies.push_back({environmentRadiance(name), environmentNamed(name)->harmonics});
    return skies;
}

/// A base surface that is compared, and where it is seen from.
struct LitBase {
    const char* name;
    double tiles;
    dvec3 forward;
};
constexpr std::array<LitBase, 2> kLitBases = {{{"torus", 8, {0, 0.8, -0.6}}, {"teapot", 6, {-0.5, 0.7, -0.5}}}};

/// Draws a surface under each sky, and returns the light that its pixels get.
Result<std::vector<Layer>> drawnLight(HostRenderer& renderer, const MesoSurface& surface, FrameRequest request) {
    std::vector<Layer> all;
    VCP_TRY(renderer.setSurfaces(std::span(&surface, 1)));
    for (const char* name : kEnvironmentNames) {
        request.shading.environment = environmentNamed(name);
        request.shading.environment->up = {0, 0, 1};
        VCP_TRY(renderer.update(request));
        VCP_TRY(renderer.render(request));
        VCP_TRY_ASSIGN(const auto picture, renderer.readPicture());
        Layer& layer = all.emplace_back();
        for (size_t i = 0; i < picture.rgba.size(); i += 4)
            layer.push_back(
                glm::pow(dvec3(picture.rgba[i], picture.rgba[i + 1], picture.rgba[i + 2]) / (255 * kGrey), dvec3(2.2)));
    }
    return all;
}

Result<std::vector<MesoLight>> compareBaseLight(const std::string& name, const Shape& shape,
                                                const std::shared_ptr<const TransferVolume>& volume, const LitBase& of,
                                                const std::function<bool(double)>& progress) {
    MesoSurfaceDescription described;
    described.asset = name, described.method.name = "boxes", described.base = of.name;
    described.tiles = of.tiles, described.colour = glm::vec3(float(kGrey)), described.withFar = false;
    VCP_TRY_ASSIGN(auto scene, makeMesoScene(std::span(&described, 1)));
    MesoSurface& surface = scene.surfaces[0];
    VCP_TRY_ASSIGN(const auto base, makeBaseSurface(of.name, of.tiles));
    const double slab = tileEdge(base) * shape.extent().z;

    FrameRequest request;
    request.width = kAcross, request.height = kDown;
    request.camera = fitCamera(scene.bounds.low, scene.bounds.high, glm::normalize(of.forward), {0, 0, 1}, 0.6,
                               double(kAcross) / kDown);
    request.shading.lightStrength = 0;
    VCP_TRY_ASSIGN(const auto renderer, HostRenderer::create({}));
    VCP_TRY_ASSIGN(const auto open, drawnLight(*renderer, surface, request));
    surface.transfer = volume;
    VCP_TRY_ASSIGN(const auto tile, drawnLight(*renderer, surface, request));
    std::vector<SceneBase> bases{sceneBase(base, shape, slab, 0, double(volume->albedo))};
    bases[0].isAsked = true;
    VCP_TRY_ASSIGN(const auto traced, traceBases(bases));
    surface.baseTransfer = traced[0];
    VCP_TRY_ASSIGN(const auto both, drawnLight(*renderer, surface, request));
    VCP_TRY_ASSIGN(const auto depths, renderer->readDepth());

    const std::vector<Sky> skies = allSkies();
    const ShellPaths paths({{&shape, base, slab}}, double(volume->albedo));
    const auto follow = [&](const TilePoint& from, dvec3 towards, PathRandom& random) {
        return paths.follow(from, towards, random);
    };
    std::vector<Pixel> pixels(depths.size());
    const auto fill = [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) {
            const CameraRay ray =
                cameraRay(request.camera, kAcross, kDown, double(i % kAcross) + 0.5, double(i / kAcross) + 0.5);
            const TileMeeting seen = paths.meet(ray.origin, ray.direction);
            pixels[i].isSeen = seen.kind == TileMeeting::Kind::Surface && std::isfinite(depths[i]);
            if (pixels[i].isSeen) followPaths(seen.point, follow, skies, kPaths / 2, i, pixels[i]);
        }
    };
    if (!shareOut(pixels.size(), fill, [&](double part) { return !progress || progress(part); }))
        return Error::cancelled();
    std::vector<bool> isSeen;
    for (const Pixel& pixel : pixels) isSeen.push_back(pixel.isSeen);
    std::vector<MesoLight> all;
    for (size_t s = 0; s < kSkies; ++s) {
        const Layer truth = layerOf(pixels, &Pixel::truth, s), bands = layerOf(pixels, &Pixel::bands, s);
        const auto add = [&](const char* form, Layer light, const Layer& should) {
            for (size_t i = 0; i < light.size(); ++i)
                if (!isSeen[i]) light[i] = dvec3(0);
            MesoLight made = compared({kAcross, kDown}, light, should, isSeen);
            made.asset = fmt::format("{} on {}", name, of.name), made.sky = kEnvironmentNames[s], made.form = form;
            made.bytes = volume->bytes() + surface.baseTransfer->changes.size() * sizeof(float);
            all.push_back(made);
        };
        add("open", open[s], truth);
        add("16 harmonics", bands, truth);
        add("tile", tile[s], truth);
        add("tile and base", both[s], truth);
        add("tile and base against 16 harmonics", both[s], bands);
    }
    return all;
}

}  // namespace

Result<std::vector<MesoLight>> compareMesoLight(const std::string& name, const Asset& asset, const Shape& shape,
                                                const std::function<bool(double)>& progress) {
    const auto shared = [&](double from, double to) {
        return [&progress, from, to](size_t count, const std::function<void(size_t, size_t)>& fill) {
            return shareOut(count, fill, [&](double part) { return !progress || progress(from + (to - from) * part); });
        };
    };
    std::shared_ptr<const TransferVolume> volume = asset.transfer;
    if (!volume) {
        VCP_TRY_ASSIGN(auto traced, traceTransfer(shape, {.shareOut = shared(0, 0.2)}));
        volume = std::make_shared<const TransferVolume>(std::move(traced));
    }
    const std::vector<Sky> skies = allSkies();
    const TilePaths paths(shape, double(volume->albedo));
    const TransferReader reader(*volume);
    std::vector<Pixel> pixels(size_t{kPixels} * kPixels);
    const auto fill = [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) pixels[i] = pixelOf(paths, reader, skies, i);
    };
    if (!shared(0.2, 0.4)(pixels.size(), fill)) return Error::cancelled();
    if (std::ranges::count_if(pixels, &Pixel::isSeen) == 0)
        return Error{.code = ErrorCode::Usage, .message = "nothing of " + asset.name + " is seen"};
    std::vector<MesoLight> all;
    const std::vector<bool> everywhere(pixels.size(), true);
    for (size_t s = 0; s < kSkies; ++s) {
        const auto add = [&](const char* form, Lights Pixel::*of, Lights Pixel::*truth) {
            MesoLight made =
                compared({kPixels, kPixels}, layerOf(pixels, of, s), layerOf(pixels, truth, s), everywhere);
            made.asset = asset.name, made.sky = kEnvironmentNames[s], made.form = form, made.bytes = volume->bytes();
            all.push_back(made);
        };
        add("open", &Pixel::open, &Pixel::truth);
        add("16 harmonics", &Pixel::bands, &Pixel::truth);
        add("volume", &Pixel::volume, &Pixel::truth);
        add("volume against 16 harmonics", &Pixel::volume, &Pixel::bands);
    }
    double from = 0.4;
    for (const LitBase& base : kLitBases) {
        const double to = from + 0.6 / kLitBases.size();
        VCP_TRY_ASSIGN(const auto lights, compareBaseLight(name, shape, volume, base, [&](double part) {
                           return !progress || progress(from + (to - from) * part);
                       }));
        all.insert(all.end(), lights.begin(), lights.end());
        from = to;
    }
    return all;
}

}  // namespace vcp
