// What a remeshed closed surface looks like while the camera comes near: remesh_dolly [FRAMES]. A sphere of noise is
// drawn as often, from six radii to two, in pictures of 480 x 360 with one ray a pixel, remeshed in several ways and
// marched exactly (`pyramid`). Prints a row a way:
//   cracks      pixels through which something behind the surface is seen, of all pictures together
//   silhouette  the greatest distance of a pixel on either silhouette from the other one (Hausdorff), pixels
//   change      root mean square by which a pixel changes from picture to picture, of 255
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "render/picture_renderer.h"
#include "viewer/scene/meso_scene.h"

namespace vcp {
namespace {

constexpr int kWidth = 480, kHeight = 360;
constexpr int kEvery = 16;       // of the pictures, for silhouettes
constexpr float kBehind = 0.2f;  // radii; more than the height of the noise
constexpr double kFarthest = 6, kNearest = 2;

struct Seen {
    std::vector<float> depths;
    Picture picture;
};

struct Way {
    std::string name;
    MesoSurfaceDescription surface;
    std::unique_ptr<PictureRenderer> renderer = nullptr;
    std::optional<Seen> last = std::nullopt;
    uint64_t cracks = 0;
    double farthest = 0, squares = 0, sum = 0;  // sum: of distances of silhouettes
};

Result<void> open(Way& way) {
    RendererOptions options;
    options.device = way.surface.method.name == kRemeshMethod ? "" : "host";
    options.budgetBytes = 256 << 20;
    VCP_TRY_ASSIGN(way.renderer, createPictureRenderer(options));
    VCP_TRY_ASSIGN(const auto scene, makeMesoScene({&way.surface, 1}));
    return way.renderer->setSurfaces(scene.surfaces);
}

Result<Seen> draw(Way& way, const FrameRequest& request) {
    VCP_TRY(way.renderer->drawSettled(request));
    Seen seen;
    VCP_TRY_ASSIGN(seen.depths, way.renderer->readDepth());
    VCP_TRY_ASSIGN(seen.picture, way.renderer->readPicture());
    return seen;
}

size_t at(int x, int y) { return size_t(y) * kWidth + size_t(x); }

/// Calls visit(x, y) for each pixel that has eight neighbours.
template <class Visit>
void eachInner(Visit&& visit) {
    for (int y = 1; y + 1 < kHeight; ++y)
        for (int x = 1; x + 1 < kWidth; ++x) visit(x, y);
}

template <class Test>
bool isSoAround(int x, int y, Test&& test) {
    for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i)
            if (!test(at(x + i, y + j))) return false;
    return true;
}

/// Counts pixels where something far behind is seen, though the exact surface is there and all about them, and of the
/// 24 pixels three away at most four see as far: lines and points are cracks, what lies beyond a silhouette is none.
uint64_t cracksOf(const Seen& seen, const Seen& exact) {
    constexpr int kAway = 3;
    uint64_t cracks = 0;
    eachInner([&](int x, int y) {
        const float nearer = seen.depths[at(x, y)] - kBehind;
        if (!isSoAround(x, y, [&](size_t i) { return exact.depths[i] < nearer; })) return;
        int asFar = 0;
        for (int j = -kAway; j <= kAway; ++j)
            for (int i = -kAway; i <= kAway; ++i) {
                if (std::max(std::abs(i), std::abs(j)) != kAway) continue;
                const int column = std::clamp(x + i, 0, kWidth - 1), row = std::clamp(y + j, 0, kHeight - 1);
                asFar += seen.depths[at(column, row)] >= nearer;
            }
        cracks += asFar <= 4;
    });
    return cracks;
}

std::vector<glm::vec2> silhouetteOf(const Seen& seen) {
    const auto isHit = [&](size_t i) { return std::isfinite(seen.depths[i]); };
    std::vector<glm::vec2> pixels;
    eachInner([&](int x, int y) {
        if (isHit(at(x, y)) && !isSoAround(x, y, isHit)) pixels.emplace_back(x, y);
    });
    return pixels;
}

double farthestFrom(const std::vector<glm::vec2>& from, const std::vector<glm::vec2>& to) {
    float most = 0;
    for (const glm::vec2 a : from) {
        float least = 1e9f;
        for (const glm::vec2 b : to) least = std::min(least, glm::distance(a, b));
        most = std::max(most, least);
    }
    return most;
}

double squaresBetween(const Picture& a, const Picture& b) {
    double sum = 0;
    for (size_t i = 0; i < a.rgba.size(); ++i) sum += std::pow(double(a.rgba[i]) - double(b.rgba[i]), 2);
    return sum / double(a.rgba.size()) * 4 / 3;  // alpha stays
}

Result<void> run(int frames) {
    MesoSurfaceDescription sphere;
    sphere.asset = "fbm", sphere.base = "sphere", sphere.tiles = 4, sphere.withFar = false;
    sphere.method.name = "pyramid", sphere.withBase = false;
    std::vector<Way> ways;
    ways.push_back({"pyramid, exact", sphere});
    sphere.method.name = kRemeshMethod;
    ways.push_back({"certified, half a pixel", sphere});
    sphere.errorPixels = 0;
    for (const double cell : {1.0, 5.0, 20.0})
        for (const bool filtered : {true, false}) {
            sphere.cell = cell, sphere.withFilter = filtered;
            ways.push_back({fmt::format("cells of {:g} px, {}", cell, filtered ? "filtered" : "not filtered"), sphere});
        }
    for (Way& way : ways) VCP_TRY(open(way));
    FrameRequest request;
    request.width = kWidth, request.height = kHeight;
    request.camera.forward = {0, 1, 0}, request.camera.up = {0, 0, 1};
    request.shading.lightFollowsCamera = false, request.shading.lightDirection = {0.5f, -0.7f, 0.5f};
    int compared = 0;
    for (int frame = 0; frame < frames; ++frame) {
        const double part = double(frame) / double(std::max(frames - 1, 1));
        request.camera.eye = {0, -kFarthest * std::pow(kNearest / kFarthest, part), 0};
        const bool compares = frame % kEvery == 0;
        compared += compares;
        std::vector<glm::vec2> border;
        for (Way& way : ways) {
            VCP_TRY_ASSIGN(auto seen, draw(way, request));
            if (&way == &ways.front() && compares) border = silhouetteOf(seen);
            const Seen& exact = &way == &ways.front() ? seen : *ways.front().last;
            way.cracks += cracksOf(seen, exact);
            if (compares) {
                const auto own = silhouetteOf(seen);
                const double off = std::max(farthestFrom(own, border), farthestFrom(border, own));
                way.farthest = std::max(way.farthest, off), way.sum += off;
            }
            if (way.last) way.squares += squaresBetween(way.last->picture, seen.picture);
            way.last = std::move(seen);
        }
    }
    fmt::print("| way | cracks | silhouette, mean | most | change |\n|---|---|---|---|---|\n");
    for (const Way& way : ways)
        fmt::print("| {} | {} | {:.2f} | {:.2f} | {:.2f} |\n", way.name, way.cracks, way.sum / compared, way.farthest,
                   std::sqrt(way.squares / std::max(frames - 1, 1)));
    return {};
}

}  // namespace
}  // namespace vcp

int main(int count, char** arguments) {
    const int frames = count > 1 ? std::atoi(arguments[1]) : 256;
    if (count > 2 || frames < 1) {
        std::fputs("usage: remesh_dolly [FRAMES]\n", stderr);
        return 2;
    }
    const auto done = vcp::run(frames);
    if (!done) std::fprintf(stderr, "remesh_dolly: %s\n", done.error().line().c_str());
    return done ? 0 : 1;
}
