#include "tests/house/rooms.h"

#include <algorithm>

namespace vcp::house {

const std::vector<Room>& rooms() {
    static const std::vector<Room> table{
        {"octree/shared", {}},
        {"octree/io", {}},
        {"octree/surface", {"octree/shared"}},
        {"octree/image", {"octree/shared", "octree/io", "octree/surface"}},
        {"octree/page", {"octree/shared", "octree/io", "octree/surface"}},
        {"octree", {"octree/shared", "octree/io", "octree/surface", "octree/image", "octree/page"}},

        {"builder/stream", {"octree/"}},
        {"builder/texture", {"octree/", "builder/stream"}},
        {"builder/mask", {"octree/", "builder/stream", "builder/texture"}},
        {"builder/mesh/gltf", {"octree/", "builder/stream"}},
        {"builder/mesh", {"octree/", "builder/stream", "builder/mesh/gltf"}},
        {"builder/spill", {"octree/"}},
        {"builder/lattice", {"octree/"}},
        {"builder/page", {"octree/", "builder/lattice"}},
        {"builder/slab", {"octree/", "builder/stream", "builder/spill", "builder/lattice", "builder/page"}},
        {"builder/level", {"octree/", "builder/stream", "builder/lattice", "builder/spill"}},
        {"builder/measure", {"octree/", "builder/stream", "builder/texture", "builder/mask", "builder/mesh"}},
        {"builder",
         {"octree/", "builder/stream", "builder/texture", "builder/mask", "builder/mesh", "builder/spill",
          "builder/lattice", "builder/page", "builder/slab", "builder/level"}},
        {"builder/parts",
         {"octree/", "builder", "builder/stream", "builder/texture", "builder/mesh", "builder/spill", "builder/lattice",
          "builder/page", "builder/level"}},
        {"builder/paper",
         {"octree/", "builder", "builder/mesh", "builder/spill", "builder/lattice", "builder/measure"}},

        {"mesostructure/gdm", {"octree/"}},
        {"mesostructure", {"octree/", "mesostructure/gdm"}},
        {"mesostructure/base", {"octree/", "mesostructure"}},
        {"mesostructure/remesh", {"octree/", "mesostructure", "mesostructure/base"}},
        {"streaming/shard", {"octree/"}},
        {"streaming", {"octree/"}},
        {"render/shared", {}},
        {"render/host", {"octree/", "mesostructure", "render/shared"}},
        {"render/pages", {"octree/", "streaming", "render/shared"}},
        {"render",
         {"octree/", "mesostructure", "mesostructure/gdm", "mesostructure/remesh", "streaming", "render/shared",
          "render/host", "render/pages"}},

        {"viewer/annotation", {"octree/", "render"}},
        {"viewer/camera", {"octree/", "render"}},
        {"viewer/asset", {"octree/", "builder/", "mesostructure/"}},
        {"viewer/scene",
         {"octree/", "builder/", "mesostructure/", "streaming", "streaming/shard", "render", "viewer/annotation",
          "viewer/camera", "viewer/asset"}},
        {"viewer/picture", {"octree/", "render"}},
        {"viewer/export", {"octree/", "builder/", "render", "viewer/annotation", "viewer/camera"}},
        {"viewer", {"octree/", "render", "viewer/camera", "viewer/asset", "viewer/scene"}},
        {"viewer/bake",
         {"octree/", "builder/", "mesostructure/", "render", "viewer/annotation", "viewer/camera", "viewer/scene",
          "viewer/picture", "viewer/asset", "viewer/export", "viewer"}},
        {"viewer/widget",
         {"octree/", "builder/", "render", "streaming", "viewer/annotation", "viewer/camera", "viewer/scene",
          "viewer/picture", "viewer"}},
        {"viewer/web/wasm/system/sys", {}},
        {"viewer/web/wasm/system/tbb", {}},
        {"viewer/web/wasm/system", {}},
        {"viewer/web/shaders", {"octree/shared", "render", "render/shared"}},
        {"viewer/web/wasm", {"octree/", "streaming", "streaming/shard", "render", "render/host", "render/pages"}},
        {"viewer/window",
         {"octree/", "builder/", "render", "render/host", "streaming", "viewer/annotation", "viewer/camera",
          "viewer/asset", "viewer/scene", "viewer/picture", "viewer/export", "viewer"}},
        {"viewer/bench/report", {"octree/"}},
        {"viewer/bench/peers", {"octree/", "builder/", "streaming", "render"}},
        {"viewer/bench/rays",
         {"octree/", "builder/", "streaming", "render", "render/host", "viewer/bench/report", "viewer/bench/peers"}},
        {"viewer/bench/picture",
         {"octree/", "builder/", "streaming", "render", "viewer/bench/report", "viewer/bench/rays"}},
        {"viewer/bench/frames",
         {"octree/", "builder/", "render", "render/host", "viewer/bench/report", "viewer/bench/rays",
          "viewer/bench/picture"}},
        {"viewer/bench/stress",
         {"octree/", "builder/", "streaming", "render", "viewer/camera", "viewer/scene", "viewer/bench/report",
          "viewer/bench/rays"}},
        {"viewer/bench",
         {"octree/", "builder/", "mesostructure", "mesostructure/remesh", "streaming", "render", "viewer/asset",
          "viewer/scene", "viewer", "viewer/bench/report", "viewer/bench/rays", "viewer/bench/picture"}},
        {"viewer/command/manual", {}},
        {"viewer/command/site", {"octree/", "streaming/"}},
        {"viewer/command/terminal", {"viewer/scene"}},
        {"viewer/command",
         {"octree/", "builder/", "mesostructure/", "streaming", "streaming/shard", "render", "viewer/annotation",
          "viewer/camera", "viewer/scene", "viewer/picture", "viewer/asset", "viewer/export", "viewer/bake", "viewer",
          "viewer/window", "viewer/bench/", "viewer/command/manual", "viewer/command/site", "viewer/command/terminal"}},
        {"viewer/examples", {}},

        {"datasets_scripts", {"octree/", "builder/"}},
    };
    return table;
}

const Room* roomOf(std::string_view path) {
    const Room* deepest = nullptr;
    for (const Room& room : rooms()) {
        const bool isInside =
            path.starts_with(room.path) && (path.size() == room.path.size() || path[room.path.size()] == '/');
        if (isInside && (!deepest || room.path.size() > deepest->path.size())) deepest = &room;
    }
    return deepest;
}

bool mayInclude(const Room& room, const Room& other) {
    const auto allows = [&](const std::string& name) {
        return name.ends_with('/') ? (other.path + "/").starts_with(name) : name == other.path;
    };
    return &room == &other || std::ranges::any_of(room.mayInclude, allows);
}

}  // namespace vcp::house
