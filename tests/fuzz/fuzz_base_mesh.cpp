// What a hostile base mesh may do: it is read as it stands, or refused in one line; what was read has a shell of finite
// numbers, or none.
#include <cmath>

#include "mesostructure/base/decimation.h"
#include "mesostructure/base/subdivision.h"
#include "mesostructure/base/surface_edges.h"
#include "mesostructure/shell.h"
#include "tests/fuzz/mesh_fuzz.h"
#include "viewer/scene/base_mesh.h"

namespace {

using vcp::fuzz::require;

vcp::Result<vcp::meso::BaseSurface> read(std::string_view bytes, size_t window) {
    return vcp::readBaseObj(vcp::ByteSource::fromMemory(bytes, "fuzz", window), 3);
}

void checkShell(const vcp::meso::BaseSurface& base) {
    const auto shell = vcp::meso::buildShell(base, 0.1 * vcp::meso::tileEdge(base), {1, 1, 0.1});
    if (!shell) return require(shell.error().line().find('\n') == std::string::npos, "an error is one line");
    require(shell->pieces > 0 && shell->pieces <= 3 * base.triangles.size(), "three pieces a triangle at most");
    require(shell->texels.size() == size_t{2} * shell->nodes + size_t{7} * shell->pieces + base.positions.size(),
            "nodes, pieces and directions");
    for (const glm::vec4& texel : shell->texels)
        require(std::isfinite(texel.x + texel.y + texel.z + texel.w), "a shell is finite");
}

/// What is made of a manifold surface is manifold; of others nothing is made.
void checkSurface(const vcp::meso::BaseSurface& base) {
    const auto edges = vcp::meso::edgesOf(base);
    if (!edges) {
        require(edges.error().line().find('\n') == std::string::npos, "an error is one line");
        return require(!vcp::meso::subdivided(base, 1) && !vcp::meso::decimated(base, {}), "and all say it");
    }
    const auto finer = vcp::meso::subdivided(base, 1);
    require(finer.ok() || edges->triangles == 0 || !finer.error().element.empty(), "a base can be subdivided");
    if (!finer) return;
    require(finer->triangles.size() == 4 * edges->triangles, "four triangles of each");
    require(vcp::meso::edgesOf(*finer).ok(), "what is finer is manifold");
    const auto coarser = vcp::meso::decimated(base, {.triangles = base.triangles.size() / 2});
    if (!coarser) return require(coarser.error().code == vcp::ErrorCode::Limit, "a base can be decimated");
    const auto left = vcp::meso::edgesOf(*coarser);
    require(left.ok() && left->parts == edges->parts, "what is coarser is manifold, with as many parts");
    require((left->border == 0) == (edges->border == 0), "and closed where the base is");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    const auto base = read(bytes, vcp::ByteSource::kWindowBytes), cut = read(bytes, 37);
    require(base.ok() == cut.ok(), "windows do not change the outcome");
    if (!base) {
        require(base.error().line() == cut.error().line(), "nor the error");
        require(base.error().line().find('\n') == std::string::npos, "an error is one line");
        return 0;
    }
    require(base->positions == cut->positions && base->triangles == cut->triangles && base->uvs == cut->uvs,
            "nor the surface");
    require(!base->triangles.empty() && base->uvs.size() == base->triangles.size(), "a map of each triangle");
    for (const auto& triangle : base->triangles)
        for (const uint32_t corner : triangle) require(corner < base->positions.size(), "corners are in range");
    checkShell(*base);
    if (base->triangles.size() <= 4096) checkSurface(*base);
    return 0;
}
