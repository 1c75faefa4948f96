// What the handles of vcp.h are, and what every call of it does first and last.
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
#include "viewer/scene/opened_scene.h"
#include "viewer/viewer.h"
#include "viewer/widget/vcp.h"

namespace vcp::widget {
/// For hosts, which take texts for UTF-8: names of files and what stands in them may be anything. What is none becomes
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
    std::unique_ptr<vcp::Renderer> renderer;  // of a view that nobody looks at; all others are added to it
    std::vector<vcp_view*> views;
    std::optional<vcp::OpenedScene> open;
    std::string name;
    std::unique_ptr<vcp::ScenePick> finest;

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
    bool isUpdated = false;  // since it was made
    bool wasSettled = false;
    bool hasSceneLight = false, hasSceneSections = false;  // of the scene file that is open
    uint32_t losses = 0;
    vcp::NextStep next;  // of the last update, less what was drawn since
    glm::dvec2 cursor{0};
    glm::dvec3 fly{0};

    /// It shows what the context has open.
    void showScene();
    void redrawIsNeeded() {
        if (context->callbacks.needs_redraw) context->callbacks.needs_redraw(context->callbacks.user, this);
    }
};

namespace vcp::widget {

/// What a call came to.
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

/// The outcome of `call`, whatever it throws.
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

/// The context's turn: one call at a time.
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
    /// The context is gone.
    void drop() { taken_ = false; }

private:
    vcp_context* context_;
    bool taken_;
};

/// Keeps the text and tells the host.
vcp_status report(vcp_context& context, std::string& lastError, Outcome outcome) noexcept;

/// A call for a context: call(Turn&).
template <class Call>
vcp_status inTurn(vcp_context* context, Call call) noexcept {
    if (!context) return VCP_USAGE;
    Turn turn(*context);
    if (!turn.isTaken()) return VCP_BUSY;
    Outcome outcome = outcomeOf([&] { return Outcome(call()); });
    return report(*context, context->lastError, std::move(outcome));
}

/// A call for a view.
template <class Call>
vcp_status inTurn(vcp_view* view, Call call) noexcept {
    if (!view) return VCP_USAGE;
    Turn turn(*view->context);
    if (!turn.isTaken()) return VCP_BUSY;
    Outcome outcome = outcomeOf([&] { return Outcome(call(*view)); });
    return report(*view->context, view->lastError, std::move(outcome));
}

/// Bytes of a struct of the host's, which may be older or younger than ours. Errors: Usage.
Result<uint32_t> structSize(const void* given);
/// Errors: Usage, where what we do not know is not zero.
Result<void> takeStruct(const void* given, void* value, size_t size);
Result<void> giveStruct(void* out, const void* value, size_t size);

/// The host's struct over `value`, which stays what it is beyond the host's size; nothing where it is null. Errors:
/// Usage.
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

/// As much of a text as there is room for.
void copyText(char* to, size_t size, const std::string& text);

inline std::string textOf(const char* text) { return text ? text : ""; }

}  // namespace vcp::widget
