#include "builder/mesh/off.h"
#include "tests/fuzz/mesh_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    vcp::fuzz::checkMesh(vcp::openOff, {reinterpret_cast<const char*>(data), size});
    return 0;
}
