#include "builder/texture/texture.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    auto image = vcp::decodeImage({reinterpret_cast<const char*>(data), size},
                                  {.edge = 1024, .bytes = 1 << 20, .fileBytes = 1 << 20});
    if (!image) return 0;
    const vcp::Texture texture(*std::move(image), vcp::Wrap::Mirror, vcp::Wrap::Repeat);
    for (const float at : {-3e38f, -0.7f, 0.0f, 0.31f, 1.0f, 7e9f}) {
        const glm::vec2 corner[3] = {{at, 0}, {0, -at}, {1, at}};
        for (const auto& footprint : {vcp::TextureFootprint::round(at), vcp::TextureFootprint::ofCorner(corner)})
            static_cast<void>(texture.sample({at, -at}, footprint));
    }
    return 0;
}
