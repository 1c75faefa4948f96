// Which renderer draws pictures.
#include "render/host_renderer.h"
#include "render/renderer.h"

namespace vcp {

Result<std::unique_ptr<PictureRenderer>> createPictureRenderer(const RendererOptions& options) {
    if (!isHostName(options.device)) {
        auto made = Renderer::create(options);
        const bool mayBeHost = options.device.empty() && !options.validation && !options.host;
        if (made || !mayBeHost || listDevices()) {
            if (!made) return made.error();
            return std::unique_ptr<PictureRenderer>(std::move(*made));
        }
    }
    VCP_TRY_ASSIGN(auto made, HostRenderer::create(options));
    return std::unique_ptr<PictureRenderer>(std::move(made));
}

}  // namespace vcp
