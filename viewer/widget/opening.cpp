#include "viewer/widget/opening.h"

#include <filesystem>
#include <utility>

#include "octree/io/caught.h"
#include "streaming/web_address.h"

namespace vcp::widget {

Result<OpenedScene> openWanted(const WantedScene& wanted,
                               const std::function<void(const std::string& file, size_t datasets)>& tell) {
    SceneFile file = wanted.file;
    if (!wanted.scenePath.empty()) {
        VCP_TRY_ASSIGN(file, readScene(wanted.scenePath));
    }
    const size_t datasets = file.datasets.size();
    const auto isCancelled = [&] { return wanted.access.cancelled && wanted.access.cancelled(); };
    const auto open = [&](const std::string& each) -> Result<OpenDataset> {
        if (isCancelled()) return Error::cancelled();
        tell(each, datasets);
        return openDataset(each, wanted.access);
    };
    return openScene(std::move(file), wanted.name, open, false,
                     [&](const char* /*stage*/, double /*part*/) { return !isCancelled(); });
}

BackgroundOpening::BackgroundOpening(WantedScene wanted) : wanted_(std::move(wanted)) {
    // Readers live longer than this.
    wanted_.access.cancelled = [token = isCancelled_] { return token->load(); };
    thread_ = std::thread([this] { run(); });
}

BackgroundOpening::~BackgroundOpening() {
    // A dataset that was opened stays usable.
    if (!isDone()) cancel();
    thread_.join();
}

void BackgroundOpening::run() {
    const auto tell = [this](const std::string& file, size_t datasets) {
        const std::lock_guard lock(mutex_);
        if (!progress_.file.empty()) ++progress_.opened;
        progress_.datasets = datasets;
        progress_.file = std::filesystem::path(shownAddress(file)).filename().string();
    };
    auto opened = caught([&] { return openWanted(wanted_, tell); }, wanted_.name);
    const std::lock_guard lock(mutex_);
    opened_ = std::move(opened);
    if (opened_->ok()) progress_.opened = progress_.datasets;
    isDone_ = true;
    news_.notify_all();
}

BackgroundOpening::Progress BackgroundOpening::progress() const {
    const std::lock_guard lock(mutex_);
    return progress_;
}

bool BackgroundOpening::isDone() const {
    const std::lock_guard lock(mutex_);
    return isDone_;
}

void BackgroundOpening::waitFor(std::chrono::milliseconds time) const {
    std::unique_lock lock(mutex_);
    news_.wait_for(lock, time, [this] { return isDone_; });
}

Result<OpenedScene> BackgroundOpening::take() {
    const std::lock_guard lock(mutex_);
    if (*isCancelled_) return Error::cancelled();
    return *std::move(opened_);
}

}  // namespace vcp::widget
