// What a renderer is made with.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/vulkan/device_info.h"
#include "streaming/load_order.h"

namespace vcp {

struct RendererOptions {
    std::string device;  ///< index, or part of the name in any case; empty: the best one; kHostName (device_info.h)
    uint64_t budgetBytes = 512ull << 20;  ///< bytes of the page pool, never exceeded; at least 1 MiB
    bool colour = true;                   ///< false: colour pages are neither read nor allocated
    bool validation = false;              ///< validation layers, core and synchronization; see validationMessages
    PageAccess access = PageAccess::Auto;
    uint32_t loaderThreads = 0;  ///< threads for all datasets, at least one each; 0: as many as their sources need
    uint64_t ramBytes =
        256ull << 20;  ///< most bytes of pages on their way to the pool, and of stored ones kept to be read again
    /// On a software device, what the host draws (host_drawing.h) is cast by the processor itself, several times as
    /// fast as by the device's shaders, which are compiled only for what else is asked for.
    bool hostRays = false;
    LoadOrder order = LoadOrder::Feedback;  ///< order in which pages are read; others than Feedback are for comparison
    bool hiddenToo = false;                 ///< also reads what no ray hits: for comparison
    uint64_t uploadBytes = 16ull << 20;     ///< bytes that one update takes into the pool (one page at least)
    DeviceFaults faults;
    std::optional<SurfaceSource> surface;  ///< absent: no surface extension is asked for
    /// Instance extensions for windows of views that are added later; the queue then has graphics.
    std::vector<std::string> windowExtensions;
    /// The host's device in place of one of our own: `device`, `validation`, `surface` and `windowExtensions` are then
    /// ignored. A lost device of the host's is not made anew: calls return errors from then on.
    std::optional<HostDevice> host;
};

}  // namespace vcp
