#include "mesostructure/asset_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static_cast<void>(vcp::meso::parseAsset({reinterpret_cast<const std::byte*>(data), size}, "fuzz"));
    return 0;
}
