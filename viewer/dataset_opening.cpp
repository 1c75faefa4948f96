#include "viewer/dataset_opening.h"

#include <utility>

#include <fmt/format.h>

#include "viewer/interrupt.h"

namespace vcp {

std::string nameOf(const std::vector<std::string>& inputs) {
    if (inputs.empty()) return {};
    std::string first = std::filesystem::path(inputs.front()).filename().string();
    return inputs.size() == 1 ? first : fmt::format("{} and {} more", first, inputs.size() - 1);
}

DatasetOpening::DatasetOpening(std::vector<std::string> inputs, BuildSettings build, SourceSettings source, ProgressStyle style)
    : inputs_(std::move(inputs)), build_(std::move(build)), source_(std::move(source)), style_(style) {
    thread_ = std::thread([this] {
        opened_ = open();
        done_ = true;
    });
}

DatasetOpening::~DatasetOpening() {
    cancel();
    thread_.join();
}

DatasetOpening::Progress DatasetOpening::progress() const {
    const std::lock_guard lock(mutex_);
    return progress_;
}

Result<OpenedScene> DatasetOpening::take() { return *std::exchange(opened_, std::nullopt); }

Result<OpenedScene> DatasetOpening::open() {
    ProgressDisplay display(style_, stderr);
    return openScene(inputs_, build_, source_, [&](const BuildProgress& at) {
        display.update(at.stage, at.fraction, detailsOf(at));
        const std::lock_guard lock(mutex_);
        progress_ = {at.stage, at.fraction, at.triangles};
        return !cancelled_ && !interrupted();
    });
}

}  // namespace vcp
