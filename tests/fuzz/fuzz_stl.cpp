#include "builder/mesh/stl.h"
#include "tests/fuzz/mesh_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    vcp::fuzz::checkMesh(vcp::openStl, {reinterpret_cast<const char*>(data), size}, true);
    return 0;
}
