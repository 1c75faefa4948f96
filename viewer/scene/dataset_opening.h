// Opens what a person names, at once or in a thread of its own: meshes are built into the cache first.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "viewer/scene/build_settings.h"
#include "viewer/scene/opened_scene.h"

namespace vcp {

/// Returns "statue.ply", or "statue.ply and 2 more"; addresses without user and password.
std::string nameOf(const std::vector<std::string>& inputs);

/// Opens one scene file, or .vcp files and addresses, each where it lies by itself, or meshes, which are built into one
/// dataset in the cache first; meshes of a scene are built one by one. `progress` as in BuildOptions. Any thread.
/// Errors: Usage (.vcp files among meshes); those of readScene, MeshCache and openDataset.
Result<OpenedScene> openScene(const std::vector<std::string>& inputs, const BuildSettings& build,
                              const SourceAccess& source, const std::function<bool(const BuildProgress&)>& progress);

/// An opening in a thread of its own. One thread may call; destroying it before it is done cancels and waits for the
/// build, or the exchange with a server, to notice.
class DatasetOpening {
public:
    struct Progress {
        std::string stage;
        double fraction = 0;
        uint64_t triangles = 0;
    };

    /// `inputs`: as openScene takes them. `told`: called in the thread with the progress, false cancels; destroyed when
    /// the work is done; may be empty.
    DatasetOpening(std::vector<std::string> inputs, BuildSettings build, const SourceAccess& source,
                   std::function<bool(const BuildProgress&)> told);
    ~DatasetOpening();
    DatasetOpening(const DatasetOpening&) = delete;
    DatasetOpening& operator=(const DatasetOpening&) = delete;

    [[nodiscard]] const std::vector<std::string>& inputs() const { return inputs_; }
    [[nodiscard]] Progress progress() const;
    void cancel() { *cancelled_ = true; }
    [[nodiscard]] bool isDone() const { return done_; }
    /// Returns what was opened; call it once, when it is done. Errors: those of openScene; Cancelled.
    Result<OpenedScene> take();

private:
    Result<OpenedScene> open();

    std::vector<std::string> inputs_;
    BuildSettings build_;
    SourceAccess source_;
    std::function<bool(const BuildProgress&)> told_;  // used by the thread
    const std::shared_ptr<std::atomic<bool>> cancelled_ =
        std::make_shared<std::atomic<bool>>(false);  // shared with readers, which live longer
    std::atomic<bool> done_ = false;
    mutable std::mutex mutex_;
    Progress progress_;                          // guarded by mutex_
    std::optional<Result<OpenedScene>> opened_;  // belongs to the thread until done_
    std::thread thread_;
};

}  // namespace vcp
