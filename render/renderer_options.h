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
    std::string device;                   ///< index, or part of the name in any case; empty: the best one
    uint64_t budgetBytes = 512ull << 20;  ///< of the page pool, never exceeded; at least 1 MiB
    bool colour = true;                   ///< false: colour pages are neither read nor allocated
    bool validation = false;              ///< validation layers, core and synchronization; see validationMessages
    PageAccess access = PageAccess::Auto;
    uint32_t loaderThreads = 0;  ///< shared out among the datasets, one each at least; 0: what their sources need
    uint64_t ramBytes =
        256ull << 20;  ///< of pages on their way to the pool, and of stored ones kept to be read again; never exceeded
    LoadOrder order = LoadOrder::Feedback;  ///< of pages; others are for comparison
    uint64_t uploadBytes = 16ull << 20;     ///< taken into the pool by one update (one page at least)
    DeviceFaults faults;
    std::optional<SurfaceSource> surface;  ///< absent: no surface extension is asked for
    /// Instance extensions for windows of views that are added later; the queue then has graphics.
    std::vector<std::string> windowExtensions;
    /// In place of a device of our own: `device`, `validation`, `surface` and `windowExtensions` are not looked at
    /// then. When it is lost it is not made anew: Errors from then on.
    std::optional<HostDevice> host;
};

}  // namespace vcp
