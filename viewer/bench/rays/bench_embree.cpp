// Embree 3 as the peer of the ray benchmark: packets of 8 coherent rays, or one ray at a time.
#include <chrono>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "builder/measure/quantile.h"
#include "builder/paper/parallel_rows.h"
#include "viewer/bench/rays/bench_tracer.h"

#ifdef VCP_HAVE_EMBREE
#include "viewer/bench/rays/embree_scene.h"
#endif

namespace vcp {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

#ifdef VCP_HAVE_EMBREE

struct FloatHit {
    float t = std::numeric_limits<float>::infinity();
    glm::vec3 normal{0};
};

constexpr int kTileWidth = 4, kTileHeight = 2;

/// Traces the tile of 8 rays at (x, y); those outside of the picture are switched off.
void traceTile(RTCScene scene, const FloatCamera& camera, glm::ivec2 size, int x, int y, std::vector<FloatHit>& out) {
    alignas(32) int valid[8];
    alignas(32) RTCRayHit8 r;
    for (int k = 0; k < 8; ++k) {
        const int px = x + k % kTileWidth, py = y + k / kTileWidth;
        valid[k] = px < size.x && py < size.y ? -1 : 0;
        const glm::vec3 d = camera.direction(float(px) + 0.5f, float(py) + 0.5f);
        r.ray.org_x[k] = camera.eye.x, r.ray.org_y[k] = camera.eye.y, r.ray.org_z[k] = camera.eye.z;
        r.ray.dir_x[k] = d.x, r.ray.dir_y[k] = d.y, r.ray.dir_z[k] = d.z;
        r.ray.tnear[k] = 0, r.ray.time[k] = 0;
        r.ray.tfar[k] = std::numeric_limits<float>::infinity();
        r.ray.mask[k] = ~0u, r.ray.flags[k] = 0, r.ray.id[k] = 0;
        r.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID, r.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect8(valid, scene, &context, &r);
    for (int k = 0; k < 8; ++k) {
        if (!valid[k]) continue;
        FloatHit& hit = out[size_t(y + k / kTileWidth) * size.x + x + k % kTileWidth];
        hit = {};
        if (r.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID)
            hit = {r.ray.tfar[k], {r.hit.Ng_x[k], r.hit.Ng_y[k], r.hit.Ng_z[k]}};
    }
}

void traceOne(RTCScene scene, const FloatCamera& camera, glm::ivec2 size, int x, int y, std::vector<FloatHit>& out) {
    RTCRayHit r{};
    const glm::vec3 d = camera.direction(float(x) + 0.5f, float(y) + 0.5f);
    r.ray.org_x = camera.eye.x, r.ray.org_y = camera.eye.y, r.ray.org_z = camera.eye.z;
    r.ray.dir_x = d.x, r.ray.dir_y = d.y, r.ray.dir_z = d.z;
    r.ray.tfar = std::numeric_limits<float>::infinity();
    r.ray.mask = ~0u;
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &r);
    FloatHit& hit = out[size_t(y) * size.x + x];
    hit = {};
    if (r.hit.geomID != RTC_INVALID_GEOMETRY_ID) hit = {r.ray.tfar, {r.hit.Ng_x, r.hit.Ng_y, r.hit.Ng_z}};
}

class EmbreeTracer final : public RayTracer {
public:
    EmbreeTracer(const IndexedMesh& mesh, bool packets, unsigned threads)
        : scene_(mesh, threads), packets_(packets), threads_(threads) {}

    [[nodiscard]] std::string device() const override { return "CPU, Embree " RTC_VERSION_STRING; }
    [[nodiscard]] uint64_t bytes() const override { return scene_.bytes(); }

    Result<TracedPicture> trace(const Camera& camera, glm::ivec2 size, int repetitions) override {
        const FloatCamera rays(camera, size, scene_.middle());
        std::vector<FloatHit> hits(size_t(size.x) * size.y);
        std::vector<double> seconds;
        for (int repetition = 0; repetition <= repetitions; ++repetition) {
            const auto start = Clock::now();
            pass(rays, size, hits);
            if (repetition > 0) seconds.push_back(secondsSince(start));
        }
        TracedPicture picture;
        picture.seconds = upperQuantile(seconds, 0.5);
        picture.hits.resize(hits.size());
        for (size_t i = 0; i < hits.size(); ++i) {
            if (!std::isfinite(hits[i].t)) continue;
            const glm::dvec3 n(hits[i].normal);
            const double length = glm::length(n);
            // This much is lost to single precision.
            const double rounding = 4e-7 * (std::abs(double(hits[i].t)) + glm::length(glm::dvec3(rays.eye)));
            picture.hits[i] = SurfaceHit{hits[i].t, length > 0 ? n / length : n, rounding};
        }
        return picture;
    }

private:
    void pass(const FloatCamera& rays, glm::ivec2 size, std::vector<FloatHit>& hits) const {
        const int height = packets_ ? kTileHeight : 1;
        forEachRow((size.y + height - 1) / height, threads_, [&](int row) {
            if (packets_)
                for (int x = 0; x < size.x; x += kTileWidth)
                    traceTile(scene_.scene(), rays, size, x, row * height, hits);
            else
                for (int x = 0; x < size.x; ++x) traceOne(scene_.scene(), rays, size, x, row, hits);
        });
    }

    EmbreeScene scene_;
    bool packets_;
    unsigned threads_;
};

#else

Error noEmbree() {
    return {.code = ErrorCode::Usage,
            .message =
                "this build has no Embree to measure against; install libembree-dev and configure again, or choose "
                "other --methods"};
}

#endif

}  // namespace

#ifdef VCP_HAVE_EMBREE

Result<std::unique_ptr<RayTracer>> makeEmbreeTracer(const IndexedMesh& mesh, bool packets, unsigned threads) {
    return std::unique_ptr<RayTracer>(std::make_unique<EmbreeTracer>(mesh, packets, threads));
}

Result<double> timeEmbreeBuild(const IndexedMesh& mesh, unsigned threads) {
    return EmbreeScene(mesh, threads).buildSeconds();
}

#else

Result<std::unique_ptr<RayTracer>> makeEmbreeTracer(const IndexedMesh&, bool, unsigned) { return noEmbree(); }
Result<double> timeEmbreeBuild(const IndexedMesh&, unsigned) { return noEmbree(); }

#endif

}  // namespace vcp
