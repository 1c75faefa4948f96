// Which renderer draws pictures.
#include "render/host_renderer.h"
#include "render/view/renderer.h"

namespace vcp {

namespace {

/// Whether the host draws where no device could be made: none was asked for, and there is none.
bool isHostNeeded(const RendererOptions& options) {
    return options.device.empty() && !options.validation && !options.host && !listDevices();
}

}  // namespace

Result<std::unique_ptr<PictureRenderer>> createPictureRenderer(const RendererOptions& options) {
    if (!isHostName(options.device)) {
        auto made = Renderer::create(options);
        if (made) return std::unique_ptr<PictureRenderer>(std::move(*made));
        if (!isHostNeeded(options)) return made.error();
    }
    VCP_TRY_ASSIGN(auto host, HostRenderer::create(options));
    return std::unique_ptr<PictureRenderer>(std::move(host));
}

}  // namespace vcp
