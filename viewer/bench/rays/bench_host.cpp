// The host's caster as a method of the ray benchmark: over the cut that the renderer would draw.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "builder/measure/quantile.h"
#include "render/frame_setup.h"
#include "render/host/host_caster.h"
#include "render/host/slab_blend.h"
#include "viewer/bench/rays/bench_tracer.h"
#include "viewer/bench/rays/drawn_cut.h"

namespace vcp {

namespace {

using Clock = std::chrono::steady_clock;

struct HostPixel {
    float t = std::numeric_limits<float>::infinity();
    glm::vec3 normal{0};
    uint32_t page = 0;  // of the scene
};

class HostTracer final : public RayTracer {
public:
    HostTracer(PageCache cache, unsigned threads, double errorPixels)
        : cache_(std::move(cache)), threads_(threads), errorPixels_(errorPixels) {}

    [[nodiscard]] std::string device() const override { return "CPU, " + hostInstructionSet(); }
    [[nodiscard]] std::string knob() const override { return fmt::format("error-pixels {:g}", errorPixels_); }
    [[nodiscard]] uint64_t bytes() const override { return bytes_; }

    Result<TracedPicture> trace(const Camera& camera, glm::ivec2 size, int repetitions) override {
        FrameRequest request;
        request.camera = camera;
        request.width = uint32_t(size.x);
        request.height = uint32_t(size.y);
        request.errorPixels = errorPixels_;
        request.colourError = kMostColourError;
        VCP_TRY_ASSIGN(const HostScene scene, loadDrawnScene(cache_, request));
        bytes_ = bytesOf(scene);
        const PictureRays rays = pictureRays(request);
        const auto frame = frameConstants(request, &cache_.dataset(), 1, false, errorPixels_);
        std::vector<HostPixel> pixels(size_t(size.x) * size.y);
        std::vector<double> seconds;
        for (int repetition = 0; repetition <= repetitions; ++repetition) {
            const auto start = Clock::now();
            VCP_TRY(forEachTile(size, {.threads = threads_}, [&](glm::ivec2 corner) {
                TileHits hits;
                hits.corner = corner;
                castTile(scene, rays, hits);
                blendSlabs(scene, {frame.pixelEdge, frame.pixelEdgePerDepth}, hits);
                take(rays, hits, pixels);
            }));
            if (repetition > 0) seconds.push_back(std::chrono::duration<double>(Clock::now() - start).count());
        }
        TracedPicture picture;
        picture.seconds = upperQuantile(seconds, 0.5);
        VCP_TRY(countWork(scene, rays, picture.work));
        picture.hits.resize(pixels.size());
        for (size_t i = 0; i < pixels.size(); ++i) {
            if (std::isinf(pixels[i].t)) continue;
            const uint64_t page = scene.page(pixels[i].page).number;
            // The depth is rounded to single precision.
            const double rounding = 2e-7 * double(pixels[i].t);
            picture.hits[i] = SurfaceHit{pixels[i].t, glm::normalize(glm::dvec3(pixels[i].normal)),
                                         cache_.dataset().pages[page].certifiedError + rounding};
        }
        return picture;
    }

private:
    /// Counts the work of each ray; of what is timed, nothing is counted.
    static Result<void> countWork(const HostScene& scene, const PictureRays& rays, RaysWork& work) {
        return forEachTile(rays.size, {.threads = 1}, [&](glm::ivec2 corner) {
            TileHits hits;
            hits.corner = corner;
            TileWork& done = hits.work.emplace();
            castTile(scene, rays, hits);
            for (int y = 0; y < hits.size.y; ++y)
                for (int i = y * kTileWidth; i < y * kTileWidth + hits.size.x; ++i)
                    work.add(done.steps[i], done.cells[i], done.fetches[i]);
        });
    }

    /// Returns the bytes of a scene's pages; the octants of one follow each other.
    [[nodiscard]] uint64_t bytesOf(const HostScene& scene) const {
        uint64_t bytes = 0, last = UINT64_MAX;
        for (uint32_t i = 0; i < scene.pages(); ++i)
            if (const uint64_t page = scene.page(i).number; std::exchange(last, page) != page)
                bytes += cache_.dataset().pages[page].pageBytes;
        return bytes;
    }

    static void take(const PictureRays& rays, const TileHits& hits, std::vector<HostPixel>& pixels) {
        for (int y = 0; y < hits.size.y; ++y)
            for (int x = 0; x < hits.size.x; ++x) {
                const int i = y * kTileWidth + x;
                const glm::ivec2 at = hits.corner + glm::ivec2(x, y);
                HostPixel& pixel = pixels[size_t(at.y) * rays.size.x + at.x];
                pixel = {};
                if (!hits.any || std::isinf(hits.depth[i])) continue;
                pixel = {
                    hits.depth[i], {hits.normalX[i], hits.normalY[i], hits.normalZ[i]}, hits.leaves[hits.leaf[i]].page};
            }
    }

    PageCache cache_;
    unsigned threads_;
    double errorPixels_;
    uint64_t bytes_ = 0;
};

}  // namespace

Result<std::unique_ptr<RayTracer>> makeHostTracer(const std::filesystem::path& file, unsigned threads,
                                                  double errorPixels) {
    VCP_TRY_ASSIGN(auto cache, PageCache::open(file));
    return std::unique_ptr<RayTracer>(std::make_unique<HostTracer>(std::move(cache), threads, errorPixels));
}

}  // namespace vcp
