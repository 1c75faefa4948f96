// Scene files: a hostile one is read, or refused in one line.
#include <cmath>

#include "tests/fuzz/mesh_fuzz.h"
#include "viewer/scene/scene_file.h"

namespace {

using vcp::fuzz::require;

bool isFinite(const glm::dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto scene = vcp::sceneFromJson({reinterpret_cast<const char*>(data), size}, "fuzz", "folder");
    if (!scene) {
        require(scene.error().line().find('\n') == std::string::npos, "an error is one line");
        return 0;
    }
    require(!scene->datasets.empty() || !scene->surfaces.empty(), "a scene shows something");
    require(scene->sections.size() <= vcp::kMostSections, "sections are as many as can be drawn");
    for (const vcp::SceneDataset& dataset : scene->datasets) {
        require(!dataset.file.empty(), "a dataset has a file");
        require(isFinite(dataset.placement.translation) && dataset.placement.scale > 0 &&
                    std::isfinite(dataset.placement.scale),
                "places are finite");
        const glm::dquat q = dataset.placement.rotation;
        require(std::abs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1) < 1e-6, "rotations are unit quaternions");
    }
    for (const vcp::MesoSurfaceDescription& surface : scene->surfaces)
        require(isFinite(surface.place) && surface.tiles > 0 && surface.scale > 0 && surface.heightScale > 0,
                "surfaces have a place and a size");
    return 0;
}
