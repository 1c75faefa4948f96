// Embree's frames: tiles of 16 x 8 pixels in packets of 4 x 2, and then the host's own light (tile_shading.h).
#include <cmath>
#include <limits>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "viewer/bench/frames/frame_drawer.h"

#ifdef VCP_HAVE_EMBREE
#include "render/host/hit_light.h"
#include "render/host/host_caster.h"
#include "render/host/layer_tiles.h"
#include "viewer/bench/picture/shading_normals.h"
#include "viewer/bench/rays/embree_scene.h"
#endif

namespace vcp {

#ifdef VCP_HAVE_EMBREE

namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr int kPacket = 8, kPackets = kTilePixels / kPacket;

/// The element of a tile's arrays that ray k of a packet belongs to.
int pixelOf(int packet, int k) {
    const int across = kTileWidth / 4;
    return (packet / across * 2 + k / 4) * kTileWidth + packet % across * 4 + k % 4;
}

glm::ivec2 placeOf(int pixel) { return {pixel % kTileWidth, pixel / kTileWidth}; }

/// Fills a ray of a packet; `Packet` is RTCRay8.
void setRay(RTCRay8& r, int k, glm::vec3 origin, glm::vec3 direction, float reach) {
    r.org_x[k] = origin.x, r.org_y[k] = origin.y, r.org_z[k] = origin.z;
    r.dir_x[k] = direction.x, r.dir_y[k] = direction.y, r.dir_z[k] = direction.z;
    r.tnear[k] = 0, r.tfar[k] = reach, r.time[k] = 0;
    r.mask[k] = ~0u, r.id[k] = 0, r.flags[k] = 0;
}

RTCIntersectContext contextOf(bool isCoherent) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = isCoherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    return context;
}

/// A tile's hits where rays of light begin: floats about the mesh's middle.
struct LightOrigins {
    glm::vec3 origin[kTilePixels];
    bool isHit[kTilePixels];
};

class EmbreeDrawing {
public:
    EmbreeDrawing(const EmbreeScene& scene, const std::vector<glm::vec3>& normals, const FrameTask& task,
                  HostPicture& picture)
        : scene_(scene),
          normals_(normals),
          task_(task),
          frame_(task.frame),
          picture_(picture),
          camera_(task.request.camera, picture.size, scene.middle()),
          reach_(float(double(frame_.occlusionReach) * task.cell)) {}

    Result<void> draw(const HostCastOptions& options) {
        const bool averagesSky = !task_.isHitsOnly && frame_.occlusionRays > 0;
        if (averagesSky) {
            sun_.resize(picture_.colours.size());
            sky_.resize(picture_.colours.size());
        }
        VCP_TRY(forEachTile(picture_.size, options, [&](glm::ivec2 corner) { drawTile(corner, averagesSky); }));
        if (!averagesSky) return {};
        return forEachTile(picture_.size, options, [&](glm::ivec2 corner) { drawKeptTile(corner); });
    }

private:
    [[nodiscard]] size_t at(glm::ivec2 pixel) const {
        return size_t(pixel.y) * size_t(picture_.size.x) + size_t(pixel.x);
    }

    void drawTile(glm::ivec2 corner, bool averagesSky) {
        TileHits hits;
        hits.corner = corner;
        trace(hits);
        if (!hits.any) return;
        TileSurface surface;
        if (task_.isHitsOnly)
            return forEachHit(hits, [&](glm::ivec2 pixel, int i) {
                picture_.depth[at(pixel)] = hits.depth[i];
                picture_.normals[at(pixel)] = {hits.normalX[i], hits.normalY[i], hits.normalZ[i]};
            });
        findNormals(task_.rays, hits, surface);
        std::fill_n(surface.sun, kTilePixels, 1.0f);
        std::fill_n(surface.sky, kTilePixels, 1.0f);
        if (frame_.hasShadows != 0 || averagesSky) {
            const LightOrigins origins = originsOf(hits, surface);
            if (frame_.hasShadows != 0) castSun(origins, surface);
            if (averagesSky) castSky(origins, corner, surface);
        }
        if (!averagesSky) return shade(hits, surface);
        forEachHit(hits, [&](glm::ivec2 pixel, int i) {
            picture_.depth[at(pixel)] = hits.depth[i];
            picture_.normals[at(pixel)] = surface.normal(i);
            sun_[at(pixel)] = uint8_t(std::lround(255 * surface.sun[i]));
            sky_[at(pixel)] = uint8_t(std::lround(255 * surface.sky[i]));
        });
    }

    template <class Visit>
    void forEachHit(const TileHits& hits, const Visit& visit) const {
        forEachPixel(picture_.size, hits.corner, [&](glm::ivec2 pixel, int i) {
            if (hits.depth[i] < kNothing) visit(pixel, i);
        });
    }

    void trace(TileHits& hits) const {
        hits.any = false;
        for (int packet = 0; packet < kPackets; ++packet) {
            alignas(32) int valid[kPacket];
            alignas(32) RTCRayHit8 r;
            for (int k = 0; k < kPacket; ++k) {
                const glm::ivec2 pixel = hits.corner + placeOf(pixelOf(packet, k));
                valid[k] = pixel.x < picture_.size.x && pixel.y < picture_.size.y ? -1 : 0;
                const glm::vec3 d =
                    camera_.corner + (float(pixel.x) + 0.5f) * camera_.perX + (float(pixel.y) + 0.5f) * camera_.perY;
                setRay(r.ray, k, camera_.eye, d, kNothing);
                r.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID, r.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
            }
            RTCIntersectContext context = contextOf(true);
            rtcIntersect8(valid, scene_.scene(), &context, &r);
            for (int k = 0; k < kPacket; ++k) takeHit(r, k, valid[k] != 0, pixelOf(packet, k), hits);
        }
    }

    void takeHit(const RTCRayHit8& r, int k, bool isValid, int i, TileHits& hits) const {
        if (!isValid || r.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) {
            hits.depth[i] = kNothing;
            hits.normalX[i] = hits.normalY[i] = hits.normalZ[i] = 0;
            return;
        }
        const glm::vec3 d(r.ray.dir_x[k], r.ray.dir_y[k], r.ray.dir_z[k]);
        const glm::vec3 flat(r.hit.Ng_x[k], r.hit.Ng_y[k], r.hit.Ng_z[k]);
        const glm::vec3* corners = &normals_[3 * size_t{r.hit.primID[k]}];
        const float u = r.hit.u[k], v = r.hit.v[k];
        glm::vec3 n = (1 - u - v) * corners[0] + u * corners[1] + v * corners[2];
        if ((glm::dot(n, flat) < 0) != (glm::dot(flat, d) > 0)) n = -n;
        hits.any = true;
        hits.depth[i] = r.ray.tfar[k] * glm::length(d);
        hits.normalX[i] = n.x, hits.normalY[i] = n.y, hits.normalZ[i] = n.z;
    }

    [[nodiscard]] LightOrigins originsOf(const TileHits& hits, const TileSurface& surface) const {
        LightOrigins origins{};
        forEachHit(hits, [&](glm::ivec2 pixel, int i) {
            const glm::vec3 d = camera_.direction(float(pixel.x) + 0.5f, float(pixel.y) + 0.5f);
            const auto cells = float(double(hits.depth[i]) / task_.cell);
            // As LayerTiles::liftAt.
            const float lift = 0.15f + frame_.lightLift * (frame_.pixelEdge + frame_.pixelEdgePerDepth * cells);
            origins.isHit[i] = true;
            origins.origin[i] = camera_.eye + hits.depth[i] * d + float(double(lift) * task_.cell) * surface.normal(i);
        });
        return origins;
    }

    void castSun(const LightOrigins& origins, TileSurface& surface) const {
        const glm::vec3 light(frame_.lightDirection);
        for (int packet = 0; packet < kPackets; ++packet) {
            alignas(32) int valid[kPacket];
            alignas(32) RTCRay8 r;
            bool any = false;
            for (int k = 0; k < kPacket; ++k) {
                const int i = pixelOf(packet, k);
                const bool faces = origins.isHit[i] && glm::dot(surface.normal(i), light) > 0;
                if (origins.isHit[i] && !faces) surface.sun[i] = 0;
                valid[k] = faces ? -1 : 0;
                any = any || faces;
                setRay(r, k, origins.origin[i], light, kNothing);
            }
            if (!any) continue;
            RTCIntersectContext context = contextOf(true);
            rtcOccluded8(valid, scene_.scene(), &context, &r);
            for (int k = 0; k < kPacket; ++k)
                if (valid[k] != 0 && r.tfar[k] < 0) surface.sun[pixelOf(packet, k)] = 0;
        }
    }

    /// How near something is counts, so these rays look for the first hit.
    void castSky(const LightOrigins& origins, glm::ivec2 corner, TileSurface& surface) const {
        std::fill_n(surface.sky, kTilePixels, 0.0f);
        const uint32_t count = frame_.occlusionRays;
        for (uint32_t number = 0; number < count; ++number)
            for (int packet = 0; packet < kPackets; ++packet) {
                alignas(32) int valid[kPacket];
                alignas(32) RTCRayHit8 r;
                bool any = false;
                for (int k = 0; k < kPacket; ++k) {
                    const int i = pixelOf(packet, k);
                    const glm::ivec2 pixel = corner + placeOf(i);
                    valid[k] = origins.isHit[i] ? -1 : 0;
                    any = any || origins.isHit[i];
                    const glm::vec3 direction =
                        origins.isHit[i] ? directions_(surface.normal(i), number, pixel) : glm::vec3(0, 0, 1);
                    setRay(r.ray, k, origins.origin[i], direction, reach_);
                    r.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID, r.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
                }
                if (!any) continue;
                RTCIntersectContext context = contextOf(false);
                rtcIntersect8(valid, scene_.scene(), &context, &r);
                for (int k = 0; k < kPacket; ++k)
                    if (valid[k] != 0)
                        surface.sky[pixelOf(packet, k)] +=
                            r.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID ? 1.0f : f32::skyBehind(r.ray.tfar[k] / reach_);
            }
        for (float& seen : surface.sky) seen /= float(count);
    }

    void setClay(TileSurface& surface) const {
        std::fill_n(surface.red, kTilePixels, frame_.clay.x);
        std::fill_n(surface.green, kTilePixels, frame_.clay.y);
        std::fill_n(surface.blue, kTilePixels, frame_.clay.z);
    }

    void shade(const TileHits& hits, TileSurface& surface) {
        setClay(surface);
        alignas(32) uint32_t colours[kTilePixels];
        shadeTile(frame_, surface, colours);
        forEachHit(hits, [&](glm::ivec2 pixel, int i) {
            picture_.depth[at(pixel)] = hits.depth[i];
            picture_.normals[at(pixel)] = surface.normal(i);
            picture_.colours[at(pixel)] = colours[i];
        });
    }

    void drawKeptTile(glm::ivec2 corner) {
        TileSurface surface{};
        TileHits hits;
        hits.corner = corner;
        std::fill_n(hits.depth, kTilePixels, kNothing);
        forEachPixel(picture_.size, corner, [&](glm::ivec2 pixel, int i) {
            const size_t from = at(pixel);
            if (!(picture_.depth[from] < kNothing)) return;
            hits.any = true;
            hits.depth[i] = picture_.depth[from];
            const glm::vec3 normal = picture_.normals[from];
            surface.normalX[i] = normal.x, surface.normalY[i] = normal.y, surface.normalZ[i] = normal.z;
            surface.sun[i] = float(sun_[from]) / 255;
            const double edge =
                double(frame_.pixelEdge) * task_.cell + double(frame_.pixelEdgePerDepth) * double(hits.depth[i]);
            surface.sky[i] = skyAround(picture_.depth, sky_, picture_.size, pixel, float(8 * edge));
        });
        if (hits.any) shade(hits, surface);
    }

    const EmbreeScene& scene_;
    const std::vector<glm::vec3>& normals_;
    const FrameTask& task_;
    const frame::FrameConstants& frame_;
    const SkyDirections directions_{frame_};
    HostPicture& picture_;
    const FloatCamera camera_;
    const float reach_;               // of occlusion, world units
    std::vector<uint8_t> sun_, sky_;  // of each pixel
};

class EmbreeDrawer final : public FrameDrawer {
public:
    EmbreeDrawer(const IndexedMesh& mesh, unsigned threads)
        : scene_(mesh, threads), normals_(shadingNormals(mesh)), options_{.threads = threads} {}

    Result<void> prepare(const FrameTask&) override { return {}; }
    Result<void> draw(const FrameTask& task, HostPicture& picture) override {
        return EmbreeDrawing(scene_, normals_, task, picture).draw(options_);
    }

private:
    EmbreeScene scene_;
    std::vector<glm::vec3> normals_;  // three a triangle
    const HostCastOptions options_;
};

}  // namespace

Result<std::unique_ptr<FrameDrawer>> makeEmbreeDrawer(const IndexedMesh& mesh, unsigned threads) {
    return std::unique_ptr<FrameDrawer>(std::make_unique<EmbreeDrawer>(mesh, threads));
}

#else

Result<std::unique_ptr<FrameDrawer>> makeEmbreeDrawer(const IndexedMesh&, unsigned) {
    return Error{.code = ErrorCode::Usage,
                 .message = "this build has no Embree to draw frames with; install libembree-dev and configure again"};
}

#endif

}  // namespace vcp
