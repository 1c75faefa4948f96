#include "streaming/web_address.h"
#include "viewer/scene/render_settings.h"
#include "viewer/widget/handles.h"
#include "viewer/widget/window_surface.h"

#include <cmath>
#include <limits>
#include <span>

#include <fmt/format.h>

namespace vcp::widget {

namespace {

constexpr double kLongestWait = 3600;

Result<std::unique_ptr<vcp_context>> createContext(const vcp_context_options& given) {
    auto made = std::make_unique<vcp_context>();
    VCP_TRY_ASSIGN(made->callbacks, taken(given.callbacks));
    RendererOptions options;
    options.device = textOf(given.device);
    options.hostRays = !given.host_device && leavesRaysToHost(options.device);
    if (given.gpu_bytes > 0) options.budgetBytes = given.gpu_bytes;
    if (given.ram_bytes > 0) options.ramBytes = given.ram_bytes;
    if (given.loader_threads > 64) return wrong("more than 64 loader threads");
    if (given.loader_threads > 0) options.loaderThreads = given.loader_threads;
    options.colour = given.without_colour == 0;
    if (given.host_device) {
        VCP_TRY_ASSIGN(const auto host, taken(given.host_device));
        options.host = HostDevice{host.instance, host.physical_device, host.device, host.queue, host.queue_family};
    } else if (given.windows != 0) {
        VCP_TRY_ASSIGN(options.windowExtensions, windowExtensions());
    }
    VCP_TRY_ASSIGN(auto renderer, Renderer::create(options));
    made->renderer = std::move(renderer);
    made->hasWindows = options.host || given.windows != 0;
    made->gpuBytes = options.budgetBytes;
    made->ramBytes = options.ramBytes;
    const DeviceInfo& device = made->renderer->device();
    made->log(VCP_LOG_INFO, fmt::format("device {}{}", device.name, device.software ? " (software)" : ""));
    return made;
}

Result<SourceAccess> accessFor(const vcp_open_options* given) {
    VCP_TRY_ASSIGN(const auto options, taken(given));
    SourceAccess access{textOf(options.ca_file), textOf(options.cache_folder)};
    if (options.cache_bytes > 0) access.cacheBytes = options.cache_bytes;
    return access;
}

/// Lets another thread cancel what is being opened.
class Opening {
public:
    explicit Opening(vcp_context& context) : context_(context) { set(isCancelled_); }
    ~Opening() { set(nullptr); }
    Opening(const Opening&) = delete;
    Opening& operator=(const Opening&) = delete;
    /// Returns a function for readers, which live longer.
    [[nodiscard]] std::function<bool()> cancelled() const {
        return [token = isCancelled_] { return token->load(); };
    }

private:
    void set(std::shared_ptr<std::atomic<bool>> token) {
        const std::lock_guard lock(context_.openingMutex);
        context_.openingIsCancelled = std::move(token);
    }

    vcp_context& context_;
    std::shared_ptr<std::atomic<bool>> isCancelled_ = std::make_shared<std::atomic<bool>>(false);
};

void cancelOpening(vcp_context& context) {
    const std::lock_guard lock(context.openingMutex);
    if (context.openingIsCancelled) *context.openingIsCancelled = true;
}

/// Shows what was opened in all views.
Result<void> show(vcp_context& context, OpenedScene open, const std::string& name) {
    context.finest.reset();
    context.open.reset();
    VCP_TRY(context.renderer->open(open.placed(), open.surfaces.surfaces));
    context.open = std::move(open);
    context.name = std::filesystem::path(shownAddress(name)).filename().string();
    context.finest = std::make_unique<ScenePick>();
    for (const OpenedScene::Part& part : context.open->parts) {
        context.finest->add(part.open.reader, *part.open.dataset, part.placement);
        const FileHeader& header = part.open.dataset->header;
        context.log(VCP_LOG_INFO, fmt::format("{}: {} triangles in {} levels", part.open.reader->name(),
                                              header.triangles, header.levels));
    }
    for (const std::string& warning : context.open->surfaces.warnings) context.log(VCP_LOG_WARNING, warning);
    for (vcp_view* view : context.views) {
        view->showScene();
        view->redrawIsNeeded();
    }
    return {};
}

/// Opens and shows what is wanted before it returns.
Result<void> openNow(vcp_context& context, Result<WantedScene> wanted) {
    if (!wanted) return wanted.error();
    context.opening.reset();
    const Opening opening(context);
    wanted->access.cancelled = opening.cancelled();
    VCP_TRY_ASSIGN(auto open, openWanted(*wanted, [](const std::string&, size_t) {}));
    return show(context, std::move(open), wanted->name);
}

Result<void> openInBackground(vcp_context& context, Result<WantedScene> wanted) {
    if (!wanted) return wanted.error();
    context.opening.reset();
    context.opening = std::make_unique<BackgroundOpening>(*std::move(wanted));
    return {};
}

/// Says how far the opening is, and shows what it opened when it is done.
Result<void> tellOfOpening(vcp_context& context, vcp_opening* out) {
    vcp_opening now{};
    if (context.opening) {
        // In this order: what is done has all of its progress.
        now.under_way = context.opening->isDone() ? 0 : 1;
        const BackgroundOpening::Progress progress = context.opening->progress();
        now.datasets = uint32_t(progress.datasets);
        now.opened = uint32_t(progress.opened);
        now.fraction = progress.datasets > 0 ? double(progress.opened) / double(progress.datasets) : 0;
        copyText(now.file, sizeof(now.file), utf8Of(progress.file));
    }
    VCP_TRY(give(out, now));
    if (!context.opening || now.under_way != 0) return {};
    const std::unique_ptr<BackgroundOpening> done = std::move(context.opening);
    VCP_TRY_ASSIGN(auto open, done->take());
    return show(context, std::move(open), done->name());
}

Result<WantedScene> wantedFrom(const char* path, const vcp_open_options* options) {
    if (!path || *path == '\0') return wrong("there is no path to open");
    WantedScene wanted{.name = path};
    VCP_TRY_ASSIGN(wanted.access, accessFor(options));
    if (isSceneName(path))
        wanted.scenePath = path;
    else
        wanted.file.datasets.push_back({path, {}});
    return wanted;
}

Result<SceneDataset> placedFrom(const vcp_placed& given, uint32_t number) {
    const std::string who = fmt::format("dataset {}", number);
    if (!given.path || *given.path == '\0')
        return Error{.code = ErrorCode::Usage, .message = "has no path", .element = who};
    SceneDataset dataset{given.path, {}};
    const std::span<const double, 16> rows(given.world_from_dataset);
    if (std::all_of(rows.begin(), rows.end(), [](double x) { return x == 0; })) return dataset;
    const auto placement = scenePlacement(rows);
    if (!placement)
        return Error{.code = ErrorCode::Usage,
                     .message = "its matrix " + placement.error().message,
                     .file = shownAddress(given.path),
                     .element = who};
    dataset.placement = *placement;
    return dataset;
}

Result<WantedScene> wantedFrom(const vcp_placed* datasets, uint32_t count, const vcp_open_options* options) {
    if (count < 1 || count > kMostSceneDatasets)
        return wrong(fmt::format("a scene has 1 to {} datasets", kMostSceneDatasets));
    WantedScene wanted;
    VCP_TRY(takeArray(datasets, count, [&](const vcp_placed& given, uint32_t number) -> Result<void> {
        VCP_TRY_ASSIGN(auto dataset, placedFrom(given, number));
        wanted.file.datasets.push_back(std::move(dataset));
        return {};
    }));
    wanted.name = wanted.file.datasets.front().file;
    VCP_TRY_ASSIGN(wanted.access, accessFor(options));
    return wanted;
}

vcp_dataset_info infoOf(const OpenedScene& open) {
    vcp_dataset_info info{};
    info.datasets = uint32_t(open.parts.size());
    info.cell = open.parts.empty() ? 0 : std::numeric_limits<double>::infinity();
    for (const OpenedScene::Part& part : open.parts) {
        const FileHeader& header = part.open.dataset->header;
        info.levels = std::max(info.levels, header.levels);
        info.triangles += header.triangles;
        info.cell = std::min(info.cell, header.cell * part.placement.scale);
        info.certified_error = std::max(info.certified_error, header.certifiedErrorMax * part.placement.scale);
    }
    const Box box = open.bounds();
    for (int i = 0; i < 3; ++i) info.bounds_min[i] = box.low[i], info.bounds_max[i] = box.high[i];
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
        VCP_TRY_ASSIGN(options, taken(given));
        VCP_TRY_ASSIGN(auto made, createContext(options));
        *context = made.release();
        return {};
    });
    copyText(options.error_text, options.error_text_size, outcome.text);
    return outcome.status;
}

vcp_status vcp_context_destroy(vcp_context* context) {
    if (!context) return VCP_OK;
    Turn turn(*context);
    if (!turn.isTaken()) {
        cancelOpening(*context);
        return VCP_BUSY;
    }
    if (!context->views.empty()) return report(*context, context->lastError, wrong("the context still has views"));
    turn.drop();
    delete context;
    return VCP_OK;
}

const char* vcp_context_last_error(const vcp_context* context) {
    return context ? context->lastError.c_str() : "there is no context";
}

vcp_status vcp_context_open(vcp_context* context, const char* path, const vcp_open_options* options) {
    return inTurn(context, [&] { return openNow(*context, wantedFrom(path, options)); });
}

vcp_status vcp_context_open_placed(vcp_context* context, const vcp_placed* datasets, uint32_t count,
                                   const vcp_open_options* options) {
    return inTurn(context, [&] { return openNow(*context, wantedFrom(datasets, count, options)); });
}

vcp_status vcp_context_start_open(vcp_context* context, const char* path, const vcp_open_options* options) {
    return inTurn(context, [&] { return openInBackground(*context, wantedFrom(path, options)); });
}

vcp_status vcp_context_start_open_placed(vcp_context* context, const vcp_placed* datasets, uint32_t count,
                                         const vcp_open_options* options) {
    return inTurn(context, [&] { return openInBackground(*context, wantedFrom(datasets, count, options)); });
}

vcp_status vcp_context_opening(vcp_context* context, vcp_opening* opening) {
    return inTurn(context, [&] { return tellOfOpening(*context, opening); });
}

vcp_status vcp_context_cancel_opening(vcp_context* context) {
    return inTurn(context, [&]() -> vcp::Result<void> {
        if (context->opening) context->opening->cancel();
        return {};
    });
}

vcp_status vcp_context_dataset(vcp_context* context, vcp_dataset_info* info) {
    return inTurn(context, [&]() -> vcp::Result<void> {
        if (!context->open) return wrong("nothing is open");
        return give(info, infoOf(*context->open));
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
        const uint64_t gpu = gpuBytes > 0 ? gpuBytes : context->gpuBytes,
                       ram = ramBytes > 0 ? ramBytes : context->ramBytes;
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
        const std::chrono::milliseconds time(std::lround(1000 * std::min(seconds, kLongestWait)));
        if (context->opening)
            context->opening->waitFor(time);
        else
            context->renderer->waitForPage(time);
        return {};
    });
}
}
