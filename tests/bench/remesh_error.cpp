// How far a remeshed surface is off on the screen, in double precision: remesh_error SCENE CAMERAS ERROR. The surface
// is the first of the scene, the cameras are those of `vcp render --path`, pictures have 1920 x 1200 pixels. Prints one
// JSON object; tests/bench/remeshing.py makes a table of them. What counts as an error: tests/support/remesh_errors.h.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "mesostructure/remesh/certified_cells.h"
#include "tests/support/remesh_errors.h"
#include "viewer/camera/camera_path.h"
#include "viewer/scene/scene_file.h"

namespace vcp {
namespace {

using namespace meso;

constexpr uint32_t kWidth = 1920, kHeight = 1200;

RemeshCamera cameraOf(const Camera& from, const RemeshSurface& surface) {
    const CameraBasis basis = cameraBasis(from, kWidth, kHeight);
    RemeshCamera camera;
    camera.eye = from.eye, camera.right = basis.right, camera.up = basis.up, camera.forward = basis.forward;
    camera.focal = kHeight / (2 * basis.halfHeight);
    camera.seen = {-basis.halfWidth, -basis.halfHeight, basis.halfWidth, basis.halfHeight};
    camera.nearest = 1e-5 * glm::distance(surface.low, surface.high);
    return camera;
}

Result<void> run(const char* sceneName, const char* camerasName, double allowed) {
    VCP_TRY_ASSIGN(const auto scene, readScene(sceneName));
    VCP_TRY_ASSIGN(const auto cameras, readCameras(camerasName));
    VCP_TRY_ASSIGN(const auto made, makeMesoScene(scene.surfaces));
    if (made.surfaces.empty() || !made.surfaces.front().remeshed.surface)
        return Error{
            .code = ErrorCode::Usage, .message = "the scene's first surface is not remeshed", .file = sceneName};
    const RemeshSurface& surface = *made.surfaces.front().remeshed.surface;
    VCP_TRY_ASSIGN(auto cells, CertifiedCells::create(surface));
    RemeshOptions options = made.surfaces.front().remeshed.options;
    options.errorPixels = allowed;
    std::vector<float> errors;
    double certified = 0;
    uint64_t vertices = 0, uncertified = 0;
    for (const OrbitCamera& orbit : cameras) {
        const RemeshCamera camera = cameraOf(orbit.current(), surface);
        RemeshMesh<double> mesh;
        VCP_TRY(remesh(cells, camera, options, mesh));
        vertices += mesh.vertices.size(), uncertified += mesh.counts.uncertified;
        certified = std::max(certified, mesh.counts.boundPixels);
        test::RemeshErrors(surface, camera, mesh, allowed).measure(errors);
    }
    if (errors.empty()) return Error{.code = ErrorCode::InvalidInput, .message = "nothing is seen", .file = sceneName};
    std::ranges::sort(errors);
    const auto at = [&](double part) { return errors[size_t(part * double(errors.size() - 1))]; };
    const auto above = errors.end() - std::ranges::upper_bound(errors, float(allowed));
    fmt::print(R"({{"vertices": {}, "certified_pixels": {:.3f}, "uncertified_patches": {:.1f}, "places": {}, )"
               R"("p50": {:.4f}, "p95": {:.4f}, "p999": {:.4f}, "max": {:.4f}, "above": {:.2g}}})"
               "\n",
               vertices / cameras.size(), certified, double(uncertified) / double(cameras.size()), errors.size(),
               at(0.5), at(0.95), at(0.999), errors.back(), double(above) / double(errors.size()));
    return {};
}

}  // namespace
}  // namespace vcp

int main(int count, char** arguments) {
    if (count != 4) {
        std::fputs("usage: remesh_error SCENE CAMERAS ERROR\n", stderr);
        return 2;
    }
    const auto done = vcp::run(arguments[1], arguments[2], std::atof(arguments[3]));
    if (!done) std::fprintf(stderr, "remesh_error: %s\n", done.error().line().c_str());
    return done ? 0 : 1;
}
