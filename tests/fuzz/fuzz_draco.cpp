// The decoder itself runs in its process, out of reach: this fuzzes what is asked of it, and what comes back.
#include "builder/mesh/gltf/draco.h"
#include "tests/fuzz/mesh_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    const auto mesh = vcp::fuzz::readMesh(vcp::openDraco(vcp::ByteSource::fromMemory(bytes, "fuzz"), 256u << 20));
    vcp::fuzz::require(mesh.error.find('\n') == std::string::npos, "an error is one line");
    return 0;
}
