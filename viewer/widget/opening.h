// What is being opened in the background: a scene, in a thread of its own.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "viewer/scene/scene_opening.h"

namespace vcp::widget {

/// What is to be opened: a scene file's path or datasets, and how servers are accessed.
struct WantedScene {
    SceneFile file = {};
    std::string scenePath = {};  ///< of a scene file, which is read in place of `file`; empty: there is none
    std::string name = {};       ///< stands for it in errors
    SourceAccess access = {};
};

/// Opens it; `tell` hears of each dataset before it is opened, and how many there are. Errors: those of readScene,
/// openScene and openDataset.
Result<OpenedScene> openWanted(const WantedScene& wanted,
                               const std::function<void(const std::string& file, size_t datasets)>& tell);

/// openWanted in a thread. One thread calls; destroying it cancels, and waits for the thread to notice.
class BackgroundOpening {
public:
    struct Progress {
        size_t datasets = 0, opened = 0;
        std::string file;  ///< what is opened now
    };

    explicit BackgroundOpening(WantedScene wanted);
    ~BackgroundOpening();
    BackgroundOpening(const BackgroundOpening&) = delete;
    BackgroundOpening& operator=(const BackgroundOpening&) = delete;

    [[nodiscard]] const std::string& name() const { return wanted_.name; }
    void cancel() { *isCancelled_ = true; }
    [[nodiscard]] Progress progress() const;
    [[nodiscard]] bool isDone() const;
    /// Waits until it is done, or the time is over.
    void waitFor(std::chrono::milliseconds time) const;
    /// Returns what was opened; call it once, when it is done. Errors: those of openWanted; Cancelled.
    Result<OpenedScene> take();

private:
    void run();

    WantedScene wanted_;  // belongs to the thread until it is done, but for the name
    const std::shared_ptr<std::atomic<bool>> isCancelled_ = std::make_shared<std::atomic<bool>>(false);
    mutable std::mutex mutex_;
    mutable std::condition_variable news_;
    Progress progress_;  // guarded by mutex_, like the next two
    bool isDone_ = false;
    std::optional<Result<OpenedScene>> opened_;
    std::thread thread_;
};

}  // namespace vcp::widget
