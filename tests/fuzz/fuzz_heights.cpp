#include <cmath>
#include <cstdlib>
#include <span>

#include "viewer/asset/height_image.h"
#include "viewer/asset/radiance_picture.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
    if (const auto light = vcp::decodeRadiance(bytes))
        for (const glm::vec3& texel : light->texels)
            for (int c = 0; c < 3; ++c)
                if (!(texel[c] >= 0 && std::isfinite(texel[c]))) std::abort();
    if (!vcp::isExr(bytes)) {
        static_cast<void>(vcp::decodeHeights(bytes, 0.1));
        return 0;
    }
    const auto picture = vcp::decodeExr(bytes, 512);
    if (!picture) return 0;
    if (picture->values.size() != size_t(picture->size.x) * size_t(picture->size.y)) std::abort();
    for (const float value : picture->values)
        if (!std::isfinite(value)) std::abort();
    static_cast<void>(vcp::heightsOf(*picture, 0.1));
    return 0;
}
