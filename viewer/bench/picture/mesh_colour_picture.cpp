#include "viewer/bench/picture/mesh_colour_picture.h"

#include <algorithm>
#include <cmath>

#include "builder/paper/parallel_rows.h"
#include "builder/stream/colour_encoding.h"

#ifdef VCP_HAVE_EMBREE
#include "viewer/bench/picture/row_rays.h"
#endif

namespace vcp {

namespace {

#ifdef VCP_HAVE_EMBREE

class EmbreeColourPicture final : public MeshColourPicture {
public:
    EmbreeColourPicture(const IndexedMesh& mesh, unsigned threads) : scene_(mesh, threads, true), threads_(threads) {}

    [[nodiscard]] uint64_t bytes() const override { return scene_.bytes(); }

    [[nodiscard]] SurfaceColours draw(const FrameRequest& request, int samples, const Paint& paint) const override {
        SurfaceColours picture({int(request.width), int(request.height)});
        const FloatCamera camera(request.camera, picture.size, scene_.middle());
        const double all = double(samples) * samples;
        forEachRow(picture.size.y, threads_, [&](int y) {
            std::vector<PaintedLight> sums(size_t(picture.size.x));
            std::vector<int> hits(sums.size());
            traceRow(scene_, camera, y, picture.size.x, samples, [&](const RTCRayHit8& r, int k, int pixel) {
                const double u = r.hit.u[k], v = r.hit.v[k];
                sums[size_t(pixel)] += paint(r.hit.primID[k], {1 - u - v, u, v});
                ++hits[size_t(pixel)];
            });
            for (size_t x = 0; x < sums.size(); ++x) {
                const size_t at = size_t(y) * sums.size() + x;
                if (sums[x].cover > 0) picture.light[at] = sums[x].light / sums[x].cover;
                picture.coverage[at] = float(hits[x] / all);
                picture.opacity[at] = float(sums[x].cover / all);
            }
        });
        return picture;
    }

private:
    EmbreeScene scene_;
    unsigned threads_;
};

#endif

// So many points of all triangles together are looked at, and of each at least 4 x 4.
constexpr double kPaintedPoints = 1 << 24;
constexpr int kLeastParts = 4, kMostParts = 64;

}  // namespace

Result<std::unique_ptr<MeshColourPicture>> MeshColourPicture::create([[maybe_unused]] const IndexedMesh& mesh,
                                                                     [[maybe_unused]] unsigned threads) {
#ifdef VCP_HAVE_EMBREE
    return std::unique_ptr<MeshColourPicture>(std::make_unique<EmbreeColourPicture>(mesh, threads));
#else
    return Error{
        .code = ErrorCode::Usage,
        .message = "this build has no Embree to draw the mesh with; install libembree-dev and configure again"};
#endif
}

VertexColours::VertexColours(const IndexedMesh& mesh, const MeshPaint& paint, unsigned threads) : mesh_(mesh) {
    const auto parts = int(
        std::clamp(std::sqrt(kPaintedPoints / double(mesh.triangles.size())), double(kLeastParts), double(kMostParts)));
    // Sums of a triangle's corners are found in threads, and added up in one order.
    using Corners = std::array<PaintedLight, 3>;
    std::vector<Corners> corners(mesh.triangles.size());
    forEachIndex(corners.size(), threads, [&](size_t t) {
        for (int j = 0; j < parts; ++j)
            for (int i = 0; i + j < parts; ++i) {
                const double u = (i + 1.0 / 3) / parts, v = (j + 1.0 / 3) / parts;
                const glm::dvec3 weights(1 - u - v, u, v);
                const PaintedLight here = paint.lightAt(mesh, t, weights);
                for (int k = 0; k < 3; ++k) corners[t][size_t(k)] += {weights[k] * here.light, weights[k] * here.cover};
            }
    });
    std::vector<PaintedLight> sums(mesh.positions.size());
    for (size_t t = 0; t < corners.size(); ++t)
        for (size_t k = 0; k < 3; ++k) sums[mesh.triangles[t][k]] += corners[t][k];
    encoded_.resize(sums.size(), glm::vec3(1));
    for (size_t v = 0; v < sums.size(); ++v)
        if (sums[v].cover > 0)
            for (int channel = 0; channel < 3; ++channel)
                encoded_[v][channel] = float(toByte(linearToSrgb(sums[v].light[channel] / sums[v].cover))) / 255;
}

PaintedLight VertexColours::lightAt(uint64_t triangle, glm::dvec3 weights) const {
    glm::dvec3 stored(0);
    for (int k = 0; k < 3; ++k) stored += weights[k] * glm::dvec3(encoded_[mesh_.triangles[triangle][size_t(k)]]);
    return {{srgbToLinear(stored.x), srgbToLinear(stored.y), srgbToLinear(stored.z)}, 1};
}

}  // namespace vcp
