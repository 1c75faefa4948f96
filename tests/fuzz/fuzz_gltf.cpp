#include "builder/mesh/gltf/gltf.h"
#include "tests/fuzz/mesh_fuzz.h"

namespace {
// Nothing lies beside the file.
vcp::Result<std::unique_ptr<vcp::MeshStream>> open(vcp::ByteSource source) {
    return vcp::openGltf(std::move(source), {}, {});
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    vcp::fuzz::checkMesh(open, {reinterpret_cast<const char*>(data), size});
    return 0;
}
