// Light from everywhere on a tile: what a volume of transfer gives, and what four bands of light can give, against a
// path tracer under the surroundings themselves.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/tile_paths.h"
#include "render/environment_light.h"
#include "viewer/asset/share_out.h"
#include "viewer/bench/bench_meso.h"
#include "viewer/bench/picture/flip.h"

namespace vcp {

namespace {

using namespace meso;
using glm::dvec3;

constexpr int kPixels = 64;        // an edge of the picture, which shows one tile
constexpr uint32_t kPaths = 1024;  // of a pixel
constexpr double kDark = 0.01;     // what a light of 0 counts in relative errors
constexpr double kGrey = 0.6;      // of the surface, encoded
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

Pixel pixelOf(const TilePaths& paths, const TransferReader& reader, std::span<const Sky> skies, size_t number) {
    Pixel pixel;
    const dvec3 extent = paths.shape().extent();
    const glm::dvec2 place((double(number % kPixels) + 0.5) / kPixels * extent.x,
                           (double(number / kPixels) + 0.5) / kPixels * extent.y);
    const TileMeeting seen = paths.see(kView, place);
    if (seen.kind != TileMeeting::Kind::Surface) return pixel;
    pixel.isSeen = true;
    const TilePoint& point = seen.point;
    PathRandom random(number);
    const glm::dvec2 shift(random.next(), random.next());
    std::array<double, 16> transfer{};
    for (uint32_t i = 0; i < kPaths; ++i) {
        glm::dvec2 p = evenPoint(i) + shift;
        p -= glm::floor(p);
        const TileEscape escape = paths.follow(point, directionByCosine(point.normal, p), random);
        if (escape.weight <= 0) continue;
        const f64::Harmonics from = f64::harmonicsOf(escape.direction);
        for (size_t k = 0; k < 16; ++k) transfer[k] += escape.weight * from.c[k] / kPaths;
        for (size_t s = 0; s < kSkies; ++s)
            pixel.truth[s] += escape.weight * skies[s].radiance(escape.direction) / double(kPaths);
    }
    const f32::Harmonics stored = reader.at(point.at, point.normal);
    const f64::Harmonics open = f64::clampedCosine(point.normal);
    for (size_t s = 0; s < kSkies; ++s) {
        pixel.bands[s] = lightOf(transfer, skies[s]);
        pixel.volume[s] = lightOf(stored.c, skies[s]);
        pixel.open[s] = lightOf(open.c, skies[s]);
    }
    return pixel;
}

ColourPicture pictureOf(std::span<const Pixel> pixels, Lights Pixel::*of, size_t sky) {
    ColourPicture picture{kPixels, kPixels, {}};
    for (const Pixel& pixel : pixels)
        picture.pixels.push_back(glm::min(kGrey * glm::pow((pixel.*of)[sky], dvec3(1 / 2.2)), dvec3(1)));
    return picture;
}

/// Compares what pixels get in one way with another.
MesoLight compared(std::span<const Pixel> pixels, Lights Pixel::*of, Lights Pixel::*truth, size_t sky) {
    MesoLight made;
    double sum = 0, sumTrue = 0, relative = 0;
    for (const Pixel& pixel : pixels)
        for (int c = 0; c < 3; ++c) {
            const double is = (pixel.*of)[sky][c], should = (pixel.*truth)[sky][c];
            relative += (is - should) * (is - should) / (should * should + kDark);
            sum += is, sumTrue += should;
        }
    made.relativeMse = relative / (3.0 * double(pixels.size()));
    made.energy = sum / sumTrue;
    const std::vector<double> differences = flip(pictureOf(pixels, truth, sky), pictureOf(pixels, of, sky));
    made.flipMean = std::accumulate(differences.begin(), differences.end(), 0.0) / double(differences.size());
    return made;
}

}  // namespace

Result<std::vector<MesoLight>> compareMesoLight(const Asset& asset, const Shape& shape,
                                                const std::function<bool(double)>& progress) {
    const auto shared = [&](double from, double to) {
        return [&progress, from, to](size_t count, const std::function<void(size_t, size_t)>& fill) {
            return shareOut(count, fill, [&](double part) { return !progress || progress(from + (to - from) * part); });
        };
    };
    std::shared_ptr<const TransferVolume> volume = asset.transfer;
    if (!volume) {
        VCP_TRY_ASSIGN(auto traced, traceTransfer(shape, {.shareOut = shared(0, 0.5)}));
        volume = std::make_shared<const TransferVolume>(std::move(traced));
    }
    std::vector<Sky> skies;
    for (const char* name : kEnvironmentNames)
        skies.push_back({environmentRadiance(name), environmentNamed(name)->harmonics});
    const TilePaths paths(shape, double(volume->albedo));
    const TransferReader reader(*volume);
    std::vector<Pixel> pixels(size_t{kPixels} * kPixels);
    const auto fill = [&](size_t first, size_t last) {
        for (size_t i = first; i < last; ++i) pixels[i] = pixelOf(paths, reader, skies, i);
    };
    if (!shared(0.5, 1)(pixels.size(), fill)) return Error::cancelled();
    if (std::ranges::count_if(pixels, &Pixel::isSeen) == 0)
        return Error{.code = ErrorCode::Usage, .message = "nothing of " + asset.name + " is seen"};
    std::vector<MesoLight> all;
    for (size_t s = 0; s < kSkies; ++s) {
        const auto add = [&](const char* form, Lights Pixel::*of, Lights Pixel::*truth) {
            MesoLight made = compared(pixels, of, truth, s);
            made.asset = asset.name, made.sky = kEnvironmentNames[s], made.form = form, made.bytes = volume->bytes();
            all.push_back(made);
        };
        add("open", &Pixel::open, &Pixel::truth);
        add("16 harmonics", &Pixel::bands, &Pixel::truth);
        add("volume", &Pixel::volume, &Pixel::truth);
        add("volume against 16 harmonics", &Pixel::volume, &Pixel::bands);
    }
    return all;
}

}  // namespace vcp
