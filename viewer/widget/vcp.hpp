// vcp.hpp: vcp.h for C++17, header only. Handles clean up after themselves, functions are members, errors are
// exceptions of type vcp::widget::Error; callbacks are std::function. vcp.h says what calls mean, and in which threads
// they may be made.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "vcp.h"

namespace vcp::widget {

class Error : public std::runtime_error {
public:
    Error(vcp_status status, const std::string& what)
        : std::runtime_error(what.empty() ? vcp_status_text(status) : what), status_(status) {}
    [[nodiscard]] vcp_status status() const { return status_; }

private:
    vcp_status status_;
};

/// Throws where `status` is not VCP_OK; `lastError`: vcp_context_last_error or vcp_view_last_error.
template <class Handle>
void check(vcp_status status, const Handle* handle, const char* (*lastError)(const Handle*)) {
    // The thread whose turn it is may be writing the text just now.
    if (status == VCP_BUSY) throw Error(status, "a call for this context has not ended yet");
    if (status != VCP_OK) throw Error(status, lastError(handle));
}

/// A struct of vcp.h with its size set and the rest zero.
template <class T>
T sized() {
    T made{};
    made.struct_size = sizeof(T);
    return made;
}

struct Callbacks {
    std::function<void(vcp_log_level, const char*)> log;
    std::function<void(vcp_status, const char*)> error;
    std::function<void(vcp_view*)> needsRedraw, settled;
};

/// A dataset in its place: a .vcp file or its address, and a matrix row by row (vcp_placed); all zero: where it lies by
/// itself.
struct Placed {
    std::string path;
    std::array<double, 16> worldFromDataset{};
};

/// A line from point to point, painted over pictures (vcp_line).
struct Line {
    std::vector<std::array<double, 3>> points;
    std::array<float, 4> colour{1, 1, 1, 1};
    float width = 2;
};

/// A picture: RGBA, and the distance of each pixel.
struct Frame {
    uint32_t width = 0, height = 0;
    std::vector<uint8_t> rgba;
    std::vector<float> depth;
};

/// A context that its views and copies share: destroyed with the last of them.
class Context {
public:
    /// `options.callbacks` is ignored.
    explicit Context(vcp_context_options options = sized<vcp_context_options>(), Callbacks callbacks = {})
        : shared_(std::make_shared<Shared>()) {
        shared_->callbacks = std::move(callbacks);
        vcp_callbacks calls = sized<vcp_callbacks>();
        calls.user = &shared_->callbacks;
        calls.log = [](void* user, vcp_log_level level, const char* text) {
            call(static_cast<Callbacks*>(user)->log, level, text);
        };
        calls.error = [](void* user, vcp_status status, const char* text) {
            call(static_cast<Callbacks*>(user)->error, status, text);
        };
        calls.needs_redraw = [](void* user, vcp_view* view) { call(static_cast<Callbacks*>(user)->needsRedraw, view); };
        calls.settled = [](void* user, vcp_view* view) { call(static_cast<Callbacks*>(user)->settled, view); };
        std::array<char, 512> text{};
        options.callbacks = &calls;
        options.error_text = text.data();
        options.error_text_size = text.size();
        if (const vcp_status status = vcp_context_create(&options, &shared_->handle); status != VCP_OK)
            throw Error(status, text.data());
    }

    void open(const std::string& path, const vcp_open_options* options = nullptr) {
        check(vcp_context_open(handle(), path.c_str(), options));
    }
    /// Opens several datasets together, each in its place.
    void open(const std::vector<Placed>& datasets, const vcp_open_options* options = nullptr) {
        const std::vector<vcp_placed> placed = structsOf(datasets);
        check(vcp_context_open_placed(handle(), placed.data(), uint32_t(placed.size()), options));
    }
    /// Begins to open in the background, and returns at once.
    void startOpen(const std::string& path, const vcp_open_options* options = nullptr) {
        check(vcp_context_start_open(handle(), path.c_str(), options));
    }
    void startOpen(const std::vector<Placed>& datasets, const vcp_open_options* options = nullptr) {
        const std::vector<vcp_placed> placed = structsOf(datasets);
        check(vcp_context_start_open_placed(handle(), placed.data(), uint32_t(placed.size()), options));
    }
    /// Says how far that is; the call that finds it done shows it, or throws what ended it.
    vcp_opening opening() { return got(vcp_context_opening); }
    void cancelOpening() { check(vcp_context_cancel_opening(handle())); }
    [[nodiscard]] vcp_dataset_info dataset() const { return got(vcp_context_dataset); }
    [[nodiscard]] vcp_device_info device() const { return got(vcp_context_device); }
    /// Sets budgets; 0: as it is.
    void setBudgets(uint64_t gpuBytes, uint64_t ramBytes = 0) {
        check(vcp_context_set_budgets(handle(), gpuBytes, ramBytes));
    }
    void wait(double seconds) { check(vcp_context_wait(handle(), seconds)); }
    [[nodiscard]] vcp_context* handle() const { return shared_->handle; }

private:
    struct Shared {
        Callbacks callbacks;
        vcp_context* handle = nullptr;
        Shared() = default;
        Shared(const Shared&) = delete;
        Shared& operator=(const Shared&) = delete;
        ~Shared() { vcp_context_destroy(handle); }
    };

    static std::vector<vcp_placed> structsOf(const std::vector<Placed>& datasets) {
        std::vector<vcp_placed> placed;
        for (const Placed& dataset : datasets) {
            placed.push_back(sized<vcp_placed>());
            placed.back().path = dataset.path.c_str();
            std::copy(dataset.worldFromDataset.begin(), dataset.worldFromDataset.end(),
                      placed.back().world_from_dataset);
        }
        return placed;
    }
    // No exception may cross the library.
    template <class F, class... T>
    static void call(const F& f, T... values) noexcept {
        if (f) f(values...);
    }
    void check(vcp_status status) const { widget::check(status, handle(), vcp_context_last_error); }
    template <class T>
    T got(vcp_status (*get)(vcp_context*, T*)) const {
        T value = sized<T>();
        check(get(handle(), &value));
        return value;
    }

    std::shared_ptr<Shared> shared_;
};

class View {
public:
    View(Context context, vcp_view_options options) : context_(std::move(context)) {
        vcp_view* made = nullptr;
        if (const vcp_status status = vcp_view_create(context_.handle(), &options, &made); status != VCP_OK)
            throw Error(status, vcp_context_last_error(context_.handle()));
        view_.reset(made);
    }
    View(View&&) = default;
    /// The former view is destroyed before its context.
    View& operator=(View&& other) noexcept {
        if (this == &other) return *this;
        view_.reset();
        context_ = std::move(other.context_);
        view_ = std::move(other.view_);
        return *this;
    }
    /// Makes a view without a window.
    View(Context context, uint32_t width, uint32_t height) : View(std::move(context), offscreen(width, height)) {}

    void resize(uint32_t width, uint32_t height) { check(vcp_view_resize(handle(), width, height)); }
    void press(vcp_button button, double x, double y, uint32_t modifiers = 0) {
        check(vcp_view_mouse_press(handle(), button, x, y, modifiers));
    }
    void move(double x, double y) { check(vcp_view_mouse_move(handle(), x, y)); }
    void release(vcp_button button) { check(vcp_view_mouse_release(handle(), button)); }
    void scroll(double x, double y, double notches, uint32_t modifiers = 0) {
        check(vcp_view_mouse_scroll(handle(), x, y, notches, modifiers));
    }
    void key(uint32_t character, bool pressed) { check(vcp_view_key(handle(), character, pressed ? 1 : 0)); }
    void act(vcp_action action) { check(vcp_view_act(handle(), action)); }

    [[nodiscard]] vcp_camera camera() const { return got(vcp_view_get_camera); }
    void setCamera(const vcp_camera& camera) { check(vcp_view_set_camera(handle(), &camera)); }
    void moveCamera(const vcp_camera& camera) { check(vcp_view_move_camera(handle(), &camera)); }
    [[nodiscard]] vcp_look look() const { return got(vcp_view_get_look); }
    void setLook(const vcp_look& look) { check(vcp_view_set_look(handle(), &look)); }
    /// nullptr: the light is as before.
    void setEnvironment(const char* source, float turnDegrees = 0, float strength = 1) {
        check(vcp_view_set_environment(handle(), source, turnDegrees, strength));
    }

    void setVisible(uint32_t dataset, bool isVisible) {
        check(vcp_view_set_visible(handle(), dataset, isVisible ? 1 : 0));
    }
    [[nodiscard]] bool isVisible(uint32_t dataset) const {
        uint32_t visible = 0;
        check(vcp_view_is_visible(handle(), dataset, &visible));
        return visible != 0;
    }
    /// Paints lines over pictures, in place of those before.
    void setLines(const std::vector<Line>& lines) {
        std::vector<vcp_line> structs;
        for (const Line& line : lines) {
            vcp_line& made = structs.emplace_back(sized<vcp_line>());
            made.points = line.points.empty() ? nullptr : line.points.front().data();
            made.point_count = uint32_t(line.points.size());
            std::copy(line.colour.begin(), line.colour.end(), made.colour);
            made.width = line.width;
        }
        check(vcp_view_set_lines(handle(), structs.data(), uint32_t(structs.size())));
    }

    vcp_step update() { return got(vcp_view_update); }
    void render() { check(vcp_view_render(handle())); }
    /// Returns false where the time was over before it was settled.
    bool settle(double seconds) {
        const vcp_status status = vcp_view_settle(handle(), seconds);
        if (status != VCP_CANCELLED) check(status);
        return status == VCP_OK;
    }
    [[nodiscard]] Frame read(bool withDepth = true) const {
        vcp_frame frame = sized<vcp_frame>();
        check(vcp_view_read(handle(), &frame));
        const size_t pixels = size_t{frame.width} * frame.height;
        Frame read{frame.width, frame.height, std::vector<uint8_t>(4 * pixels),
                   std::vector<float>(withDepth ? pixels : 0)};
        frame.rgba = read.rgba.data();
        frame.rgba_size = read.rgba.size();
        frame.depth = withDepth ? read.depth.data() : nullptr;
        frame.depth_size = read.depth.size();
        check(vcp_view_read(handle(), &frame));
        return read;
    }
    void savePng(const std::string& path) { check(vcp_view_save_png(handle(), path.c_str())); }
    void copyTo(const vcp_host_image& image) { check(vcp_view_copy_to_image(handle(), &image)); }
    [[nodiscard]] vcp_pick pick(double x, double y) {
        vcp_pick picked = sized<vcp_pick>();
        check(vcp_view_pick(handle(), x, y, &picked));
        return picked;
    }
    [[nodiscard]] vcp_stats stats() const { return got(vcp_view_stats); }
    [[nodiscard]] const Context& context() const { return context_; }
    [[nodiscard]] vcp_view* handle() const { return view_.get(); }

private:
    struct Destroy {
        void operator()(vcp_view* view) const { vcp_view_destroy(view); }
    };

    static vcp_view_options offscreen(uint32_t width, uint32_t height) {
        vcp_view_options options = sized<vcp_view_options>();
        options.width = width;
        options.height = height;
        return options;
    }
    void check(vcp_status status) const { widget::check(status, handle(), vcp_view_last_error); }
    template <class T>
    T got(vcp_status (*get)(vcp_view*, T*)) const {
        T value = sized<T>();
        check(get(handle(), &value));
        return value;
    }

    Context context_;
    std::unique_ptr<vcp_view, Destroy> view_;
};

/// Builds one .vcp file. `options.inputs` and `output` come from the arguments; `progress` returns false to cancel.
inline vcp_build_report build(const std::vector<std::string>& inputs, const std::string& output,
                              const std::function<bool(const vcp_progress&)>& progress = {},
                              vcp_build_options options = sized<vcp_build_options>()) {
    std::vector<const char*> paths;
    for (const std::string& input : inputs) paths.push_back(input.c_str());
    std::array<char, 512> text{};
    options.inputs = paths.data();
    options.input_count = uint32_t(paths.size());
    options.output = output.c_str();
    options.user = const_cast<void*>(static_cast<const void*>(&progress));
    if (progress)
        options.progress = [](void* user, const vcp_progress* at) {
            return (*static_cast<const std::function<bool(const vcp_progress&)>*>(user))(*at) ? 1 : 0;
        };
    options.error_text = text.data();
    options.error_text_size = text.size();
    vcp_build_report report = sized<vcp_build_report>();
    if (const vcp_status status = vcp_build(&options, &report); status != VCP_OK) throw Error(status, text.data());
    return report;
}

}  // namespace vcp::widget
