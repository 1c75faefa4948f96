#include "viewer/widget/handles.h"
#include "viewer/widget/window_surface.h"

#include <cmath>

#include <fmt/format.h>

namespace vcp::widget {

namespace {

constexpr double kLongestWait = 3600;

Result<std::unique_ptr<vcp_context>> createContext(const vcp_context_options& given) {
    auto made = std::make_unique<vcp_context>();
    const auto callbacks = taken(given.callbacks);
    if (!callbacks) return callbacks.error();
    made->callbacks = *callbacks;
    RendererOptions options;
    options.device = textOf(given.device);
    if (given.gpu_bytes > 0) options.budgetBytes = given.gpu_bytes;
    if (given.ram_bytes > 0) options.ramBytes = given.ram_bytes;
    if (given.loader_threads > 64) return wrong("more than 64 loader threads");
    if (given.loader_threads > 0) options.loaderThreads = given.loader_threads;
    options.colour = given.without_colour == 0;
    if (given.host_device) {
        const auto host = taken(given.host_device);
        if (!host) return host.error();
        options.host = HostDevice{host->instance, host->physical_device, host->device, host->queue, host->queue_family};
    } else if (given.windows != 0) {
        auto extensions = windowExtensions();
        if (!extensions) return extensions.error();
        options.windowExtensions = *std::move(extensions);
    }
    auto renderer = Renderer::create(options);
    if (!renderer) return renderer.error();
    made->renderer = *std::move(renderer);
    made->hasWindows = options.host || given.windows != 0;
    made->gpuBytes = options.budgetBytes;
    made->ramBytes = options.ramBytes;
    const DeviceInfo& device = made->renderer->device();
    made->log(VCP_LOG_INFO, fmt::format("device {}{}", device.name, device.software ? " (software)" : ""));
    return made;
}

Result<void> openFor(vcp_context& context, const char* path, const vcp_open_options* given) {
    const auto options = taken(given);
    if (!options) return options.error();
    if (!path || *path == '\0') return wrong("there is no path to open");
    SourceAccess access{textOf(options->ca_file), textOf(options->cache_folder)};
    if (options->cache_bytes > 0) access.cacheBytes = options->cache_bytes;
    auto open = openDataset(path, access);
    if (!open) return open.error();
    context.finest.reset();
    context.open.reset();
    VCP_TRY(context.renderer->open(open->dataset, open->source));
    context.open = *std::move(open);
    context.name = std::filesystem::path(path).filename().string();
    context.finest = std::make_unique<FinestPick>(context.open->reader, *context.open->dataset);
    context.log(VCP_LOG_INFO, fmt::format("{}: {} triangles in {} levels", path, context.open->dataset->header.triangles, context.open->dataset->header.levels));
    for (vcp_view* view : context.views) {
        view->showDataset();
        view->redrawIsNeeded();
    }
    return {};
}

vcp_dataset_info infoOf(const Dataset& dataset) {
    const FileHeader& header = dataset.header;
    vcp_dataset_info info{};
    info.levels = header.levels;
    info.triangles = header.triangles;
    std::copy_n(header.boundsMin, 3, info.bounds_min);
    std::copy_n(header.boundsMax, 3, info.bounds_max);
    info.cell = header.cell;
    info.certified_error = header.certifiedErrorMax;
    return info;
}

}  // namespace

}  // namespace vcp::widget

using namespace vcp::widget;

extern "C" {

vcp_status vcp_context_create(const vcp_context_options* given, vcp_context** context) {
    if (!context) return VCP_USAGE;
    *context = nullptr;
    vcp_context_options options{};
    const Outcome outcome = outcomeOf([&]() -> Outcome {
        const auto read = taken(given);
        if (!read) return read.error();
        options = *read;
        auto made = createContext(options);
        if (!made) return made.error();
        *context = made->release();
        return {};
    });
    copyText(options.error_text, options.error_text_size, outcome.text);
    return outcome.status;
}

vcp_status vcp_context_destroy(vcp_context* context) {
    if (!context) return VCP_OK;
    Turn turn(*context);
    if (!turn.isTaken()) return VCP_BUSY;
    if (!context->views.empty()) return report(*context, context->lastError, wrong("the context still has views"));
    turn.drop();
    delete context;
    return VCP_OK;
}

const char* vcp_context_last_error(const vcp_context* context) { return context ? context->lastError.c_str() : "there is no context"; }

vcp_status vcp_context_open(vcp_context* context, const char* path, const vcp_open_options* options) {
    return inTurn(context, [&] { return openFor(*context, path, options); });
}

vcp_status vcp_context_dataset(vcp_context* context, vcp_dataset_info* info) {
    return inTurn(context, [&]() -> vcp::Result<void> {
        if (!context->open) return wrong("nothing is open");
        return give(info, infoOf(*context->open->dataset));
    });
}

vcp_status vcp_context_device(vcp_context* context, vcp_device_info* info) {
    return inTurn(context, [&] {
        vcp_device_info device{};
        device.software = context->renderer->device().software ? 1 : 0;
        copyText(device.name, sizeof(device.name), context->renderer->device().name);
        return give(info, device);
    });
}

vcp_status vcp_context_set_budgets(vcp_context* context, uint64_t gpuBytes, uint64_t ramBytes) {
    return inTurn(context, [&]() -> vcp::Result<void> {
        const uint64_t gpu = gpuBytes > 0 ? gpuBytes : context->gpuBytes, ram = ramBytes > 0 ? ramBytes : context->ramBytes;
        VCP_TRY(context->renderer->setBudgets(gpu, ram));
        context->gpuBytes = gpu;
        context->ramBytes = ram;
        for (vcp_view* view : context->views) view->redrawIsNeeded();
        return {};
    });
}

vcp_status vcp_context_wait(vcp_context* context, double seconds) {
    return inTurn(context, [&]() -> vcp::Result<void> {
        if (!(seconds >= 0)) return wrong("a time to wait that is below 0 or not a number");
        context->renderer->waitForPage(std::chrono::milliseconds(std::lround(1000 * std::min(seconds, kLongestWait))));
        return {};
    });
}
}
