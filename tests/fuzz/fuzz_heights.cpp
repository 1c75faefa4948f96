#include <cmath>
#include <cstdlib>

#include "viewer/height_image.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto picture = vcp::decodeExr({reinterpret_cast<const std::byte*>(data), size}, 512);
    if (!picture) return 0;
    if (picture->values.size() != size_t(picture->size.x) * size_t(picture->size.y)) std::abort();
    for (const float value : picture->values)
        if (!std::isfinite(value)) std::abort();
    (void)vcp::heightsOf(*picture, 0.1);
    return 0;
}
