#include "mesostructure/method.h"

/// What is read is marched too, so that no count or index in it reaches out of its arrays.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto asset = vcp::meso::parseAsset({reinterpret_cast<const std::byte*>(data), size}, "fuzz");
    if (!asset || !asset->gdm) return 0;
    const auto marcher = vcp::meso::gdmMarcher(*asset->gdm);
    if (!marcher) return 0;
    for (int i = 0; i < 4; ++i)
        static_cast<void>((*marcher)->march({{0.1 * i, 0.2, asset->extent.z}, {0.6, 0, i % 2 ? 0.8 : -0.8}}));
    return 0;
}
