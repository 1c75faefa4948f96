#include "viewer/bench/picture/mesh_picture.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "builder/paper/parallel_rows.h"
#include "render/frame_setup.h"

#ifdef VCP_HAVE_EMBREE
#include "viewer/bench/picture/row_rays.h"
#include "viewer/bench/picture/shading_normals.h"
#endif

namespace vcp {

namespace {

constexpr float kBackground = 0.17f;  // linear

#ifdef VCP_HAVE_EMBREE

/// What the samples of a pixel sum up to.
struct PixelSum {
    float light = 0, depth = 0;
    glm::vec3 normal{0};
    int hits = 0;
};

class EmbreePicture final : public MeshPicture {
public:
    EmbreePicture(const IndexedMesh& mesh, unsigned threads)
        : scene_(mesh, threads, true), normals_(shadingNormals(mesh)), threads_(threads) {}

    [[nodiscard]] uint64_t bytes() const override { return scene_.bytes(); }

    [[nodiscard]] LightPicture draw(const FrameRequest& request, int samples) const override {
        const glm::ivec2 size(request.width, request.height);
        const FloatCamera rays(request.camera, size, scene_.middle());
        const LightDirections lights =
            lightDirections(request, cameraBasis(request.camera, request.width, request.height));
        const size_t count = size_t(size.x) * size.y;
        LightPicture picture{size, std::vector<float>(count), std::vector<float>(count),
                             std::vector<glm::vec3>(count, glm::vec3(0)), std::vector<float>(count)};
        forEachRow(size.y, threads_, [&](int y) {
            std::vector<PixelSum> row(size.x);
            traceRow(scene_, rays, y, size.x, samples,
                     [&](const RTCRayHit8& r, int k, int pixel) { addSample(r, k, lights, row[pixel]); });
            const auto all = float(samples * samples);
            for (int x = 0; x < size.x; ++x) {
                const PixelSum& sum = row[x];
                const size_t at = size_t(y) * size.x + x;
                const float light = sum.light + (all - float(sum.hits)) * kBackground;
                picture.light[at] = std::round(255 * std::pow(light / all, 1 / 2.2f)) / 255;
                picture.coverage[at] = float(sum.hits) / all;
                picture.depth[at] = sum.hits > 0 ? sum.depth / float(sum.hits) : INFINITY;
                const float length = glm::length(sum.normal);
                if (length > 0) picture.normals[at] = sum.normal / length;
            }
        });
        return picture;
    }

private:
    void addSample(const RTCRayHit8& r, int k, const LightDirections& lights, PixelSum& sum) const {
        const glm::vec3 d(r.ray.dir_x[k], r.ray.dir_y[k], r.ray.dir_z[k]);
        const glm::vec3 flat(r.hit.Ng_x[k], r.hit.Ng_y[k], r.hit.Ng_z[k]);
        const glm::vec3* corners = &normals_[3 * size_t{r.hit.primID[k]}];
        const float u = r.hit.u[k], v = r.hit.v[k];
        // Embree's normals and ours may be of either side: the ray's side is that of the triangle.
        const bool away = glm::dot(flat, d) > 0;
        glm::vec3 n = (1 - u - v) * corners[0] + u * corners[1] + v * corners[2];
        if ((glm::dot(n, flat) < 0) != away) n = -n;
        n = glm::normalize(n);
        // As in trace.comp: a normal that leans away from the ray is bent back to it.
        n = glm::normalize(n - std::max(glm::dot(n, d), 0.0f) * d);
        sum.light += lightOn(n, glm::vec3(lights.light), glm::vec3(lights.sky));
        sum.depth += r.ray.tfar[k];
        sum.normal += n;
        ++sum.hits;
    }

    EmbreeScene scene_;
    std::vector<glm::vec3> normals_;  // three a triangle
    unsigned threads_;
};

#endif

}  // namespace

FrameRequest lightRequest(const Camera& camera, glm::ivec2 size) {
    FrameRequest request;
    request.camera = camera;
    request.width = uint32_t(size.x);
    request.height = uint32_t(size.y);
    request.shading.mode = ShadingMode::Clay;
    request.shading.clay = glm::vec3(1);
    request.shading.backgroundTop = request.shading.backgroundBottom = glm::vec3(kBackground);
    return request;
}

float lightOn(glm::vec3 normal, glm::vec3 towardsLight, glm::vec3 towardsSky) {
    const float sun = std::max(glm::dot(normal, towardsLight), 0.0f);
    return 0.72f * sun + 0.10f + 0.18f * (0.5f + 0.5f * glm::dot(normal, towardsSky));
}

Result<std::unique_ptr<MeshPicture>> MeshPicture::create([[maybe_unused]] const IndexedMesh& mesh,
                                                         [[maybe_unused]] unsigned threads) {
#ifdef VCP_HAVE_EMBREE
    return std::unique_ptr<MeshPicture>(std::make_unique<EmbreePicture>(mesh, threads));
#else
    return Error{
        .code = ErrorCode::Usage,
        .message = "this build has no Embree to draw the mesh with; install libembree-dev and configure again"};
#endif
}

}  // namespace vcp
