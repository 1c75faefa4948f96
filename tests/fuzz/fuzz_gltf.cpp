#include "builder/mask/masked_stream.h"
#include "builder/mesh/gltf/gltf.h"
#include "tests/fuzz/mesh_fuzz.h"

namespace {
// Nothing lies beside the file.
vcp::Result<std::unique_ptr<vcp::MeshStream>> open(vcp::ByteSource source) {
    return vcp::openGltf(std::move(source), {}, {});
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    vcp::fuzz::checkMesh(open, bytes);
    // What its masks leave keeps the contract, too.
    auto whole = open(vcp::ByteSource::fromMemory(bytes, "fuzz"));
    if (whole) static_cast<void>(vcp::fuzz::readMesh(vcp::maskedStream(*std::move(whole), 1 << 20)));
    return 0;
}
