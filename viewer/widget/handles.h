// What the handles of vcp.h are, and what every call does first and last.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>

#include "viewer/finest_pick.h"
#include "viewer/scene/scene_opening.h"
#include "viewer/viewer.h"
#include "viewer/widget/opening.h"
#include "viewer/widget/vcp.h"

namespace vcp::widget {
/// Makes a text valid UTF-8 for hosts: names of files and their content may be anything. Invalid bytes become
/// U+FFFD.
std::string utf8Of(const std::string& text);
}  // namespace vcp::widget

struct vcp_context {
    std::atomic_flag busy;  // a call is under way
    std::mutex openingMutex;
    std::shared_ptr<std::atomic<bool>> openingIsCancelled;  // guarded by openingMutex; null: nothing is being opened
    vcp_callbacks callbacks{};
    std::string lastError;
    std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
    bool hasWindows = false;
    uint64_t gpuBytes = 0, ramBytes = 0;
    std::unique_ptr<vcp::Renderer> renderer;  // the renderer of a view that is never shown; all others are added to it
    std::vector<vcp_view*> views;
    std::optional<vcp::OpenedScene> open;
    std::string name;
    std::unique_ptr<vcp::ScenePick> finest;
    std::unique_ptr<vcp::widget::BackgroundOpening> opening;  // null: nothing is opened in the background

    [[nodiscard]] double now() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }
    void log(vcp_log_level level, const std::string& text) const {
        if (callbacks.log) callbacks.log(callbacks.user, level, vcp::widget::utf8Of(text).c_str());
    }
};

struct vcp_view {
    vcp_context* context = nullptr;
    std::unique_ptr<vcp::Viewer> viewer;
    std::string lastError;
    bool hasWindow = false;
    vcp::UpAxis up = vcp::UpAxis::Y;
    bool isUpdated = false;  // it was updated since it was made
    bool wasSettled = false;
    bool hasNewLines = false;                              // they are not on the last picture
    bool hasSceneLight = false, hasSceneSections = false;  // whether the open scene file has them
    uint32_t losses = 0;
    vcp::NextStep next;  // result of the last update, without what was drawn since
    glm::dvec2 cursor{0};
    glm::dvec3 fly{0};

    /// Shows in the view what the context has open.
    void showScene();
    void redrawIsNeeded() {
        if (context->callbacks.needs_redraw) context->callbacks.needs_redraw(context->callbacks.user, this);
    }
};

namespace vcp::widget {

/// The result of a call.
struct Outcome {
    vcp_status status = VCP_OK;
    std::string text;

    Outcome() = default;
    Outcome(vcp_status s, std::string t) : status(s), text(std::move(t)) {}
    Outcome(const Error& error);
    Outcome(const Result<void>& result) {
        if (!result) *this = Outcome(result.error());
    }
};

inline Error wrong(std::string what) { return {.code = ErrorCode::Usage, .message = std::move(what)}; }

/// Returns the outcome of `call`, whatever it throws.
template <class Call>
Outcome outcomeOf(Call call) noexcept {
    try {
        return call();
    } catch (const std::bad_alloc&) {
        return {VCP_OUT_OF_MEMORY, "out of memory"};
    } catch (const std::exception& e) {
        return {VCP_INTERNAL, e.what()};
    } catch (...) {
        return {VCP_INTERNAL, "unknown"};
    }
}

/// A call's turn at the context: one call at a time.
class Turn {
public:
    explicit Turn(vcp_context& context)
        : context_(&context), taken_(!context.busy.test_and_set(std::memory_order_acquire)) {}
    ~Turn() {
        if (taken_) context_->busy.clear(std::memory_order_release);
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    [[nodiscard]] bool isTaken() const { return taken_; }
    /// Called when the context was destroyed.
    void drop() { taken_ = false; }

private:
    vcp_context* context_;
    bool taken_;
};

/// Keeps the text of the error and tells the host.
vcp_status report(vcp_context& context, std::string& lastError, Outcome outcome) noexcept;

/// Runs a call for a context: call(Turn&).
template <class Call>
vcp_status inTurn(vcp_context* context, Call call) noexcept {
    if (!context) return VCP_USAGE;
    Turn turn(*context);
    if (!turn.isTaken()) return VCP_BUSY;
    Outcome outcome = outcomeOf([&] { return Outcome(call()); });
    return report(*context, context->lastError, std::move(outcome));
}

/// Runs a call for a view.
template <class Call>
vcp_status inTurn(vcp_view* view, Call call) noexcept {
    if (!view) return VCP_USAGE;
    Turn turn(*view->context);
    if (!turn.isTaken()) return VCP_BUSY;
    Outcome outcome = outcomeOf([&] { return Outcome(call(*view)); });
    return report(*view->context, view->lastError, std::move(outcome));
}

/// Returns the size of a struct of the host's, which may be older or newer than ours. Errors: Usage.
Result<uint32_t> structSize(const void* given);
/// Copies a struct. Errors: Usage, where fields that we do not know are not zero.
Result<void> takeStruct(const void* given, void* value, size_t size);
Result<void> giveStruct(void* out, const void* value, size_t size);

/// Copies the host's struct over `value`, which keeps what is beyond the host's size; does nothing where it is null.
/// Errors: Usage.
template <class T>
Result<T> taken(const T* given, T value = {}) {
    if (given) VCP_TRY(takeStruct(given, &value, sizeof(T)));
    value.struct_size = sizeof(T);
    return value;
}

/// Writes as much as the host's struct has room for. Errors: Usage.
template <class T>
Result<void> give(T* out, const T& value) {
    return giveStruct(out, &value, sizeof(T));
}

/// Reads an array of the host's structs, which may be longer or shorter than ours: take(value, number) returns a
/// Result<void> for each. Errors: Usage; those of `take`.
template <class T, class Take>
Result<void> takeArray(const T* given, uint32_t count, Take take) {
    if (count == 0) return {};
    VCP_TRY_ASSIGN(const auto stride, structSize(given));
    for (uint32_t i = 0; i < count; ++i) {
        const void* at = reinterpret_cast<const char*>(given) + size_t{stride} * i;
        if (const auto size = structSize(at); !size || *size != stride)
            return wrong("struct_size is not the same in all of an array");
        T value{};
        VCP_TRY(takeStruct(at, &value, sizeof(T)));
        VCP_TRY(take(value, i));
    }
    return {};
}

/// Paints the lines over the view's pictures, from now on. Errors: Usage.
Result<void> setLines(vcp_view& view, const vcp_line* lines, uint32_t count);

/// Copies as much of a text as there is room for.
void copyText(char* to, size_t size, const std::string& text);

inline std::string textOf(const char* text) { return text ? text : ""; }

}  // namespace vcp::widget
