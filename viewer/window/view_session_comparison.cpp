// Comparing in the window: what is measured is shown in the dataset's place, and goes again.
#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "octree/io/output_file.h"
#include "viewer/window/free_name.h"
#include "viewer/window/view_session.h"

namespace vcp {

void ViewSession::compare(uint32_t dataset, uint32_t with) {
    if (with >= open_.parts.size() || dataset == with) return;
    beginComparing(dataset, with,
                   {.name = layers_[with].name,
                    .reader = open_.parts[with].open.reader,
                    .file = {},
                    .placement = open_.parts[with].placement});
}

void ViewSession::compareWithFile(uint32_t dataset, const std::string& file) {
    beginComparing(dataset, {}, {.name = nameOf({file}), .reader = nullptr, .file = file, .placement = {}});
}

void ViewSession::beginComparing(uint32_t dataset, std::optional<uint32_t> with, Comparison::Subject other) {
    if (saving() || dataset >= open_.parts.size()) return;
    endComparison();
    dismissProblem();
    comparesDataset_ = dataset;
    comparesWith_ = with;
    const OpenedScene::Part& part = open_.parts[dataset];
    comparing_ = std::make_unique<Comparison>(
        Comparison::Subject{
            .name = layers_[dataset].name, .reader = part.open.reader, .file = {}, .placement = part.placement},
        std::move(other), comparisonChoice, options_.render.source);
}

void ViewSession::setComparisonRange(double range) {
    if (!compared_ || saving() || range == compared_->shown.range) return;
    comparing_ = std::make_unique<Comparison>(compared_->shown.measured, range);
}

void ViewSession::takeCompared() {
    if (!comparing_ || !comparing_->isDone()) return;
    auto coloured = comparing_->take();
    comparing_.reset();
    const auto shown = coloured ? showCompared(*std::move(coloured)) : Result<void>(coloured.error());
    if (!shown) say(shown.error().line());
}

/// Shows the coloured dataset in place of its own, in its colours.
Result<void> ViewSession::showCompared(Comparison::Coloured coloured) {
    const uint32_t dataset = comparesDataset_;
    std::vector<PlacedDataset> datasets = open_.placed();
    datasets[dataset] = {coloured.open.dataset, coloured.open.source, {}, coloured.open.loaderThreads()};
    const Compared before{
        .shown = {}, .mode = viewer_->shading().mode, .hidden = viewer_->hidden(), .look = viewer_->lookOf(dataset)};
    VCP_TRY(replaceDatasets(std::move(datasets)));
    subject_.levels[dataset] = coloured.open.dataset->header.levels;
    const bool isAnew = !compared_;
    if (isAnew) compared_ = before;
    compared_->shown = {dataset, std::move(coloured.measured), coloured.range};
    if (!isAnew) return {};
    viewer_->setLook({.dataset = dataset, .colour = {}, .opacity = before.look.opacity});
    std::vector<uint32_t> hidden = before.hidden;
    std::erase(hidden, dataset);
    if (comparesWith_ && !std::ranges::count(hidden, *comparesWith_)) hidden.push_back(*comparesWith_);
    viewer_->setHidden(std::move(hidden));
    Shading shading = viewer_->shading();
    if (shading.mode != ShadingMode::Unlit) shading.mode = ShadingMode::Lit;
    viewer_->setShading(shading);
    const Comparison::Measured& measured = *compared_->shown.measured;
    note(fmt::format("95 % of {} lie within {} of {}; the panel (Tab) has the figures", measured.compared.a,
                     lengthText(measured.deviation.absoluteQuantile(0.95), unit()), measured.compared.b));
    return {};
}

/// Shows other datasets from where the camera is, and as they are hidden and look.
Result<void> ViewSession::replaceDatasets(std::vector<PlacedDataset> datasets) {
    const OrbitCamera camera = viewer_->camera();
    const std::vector<uint32_t> hidden = viewer_->hidden();
    const std::vector<DatasetLook> looks = viewer_->looks();
    VCP_TRY(viewer_->open(std::move(datasets), open_.surfaces, home_, viewer_->status().name));
    viewer_->setCamera(camera);
    viewer_->setHidden(hidden);
    viewer_->setLooks(looks);
    return {};
}

void ViewSession::endComparison() {
    if (!compared_) return;
    cancelSaving();
    const Compared before = *std::exchange(compared_, std::nullopt);
    if (const auto shown = replaceDatasets(open_.placed()); !shown) return say(shown.error().line());
    subject_ = open_.legendSubject();
    viewer_->setLook(before.look);
    viewer_->setHidden(before.hidden);
    Shading shading = viewer_->shading();
    shading.mode = before.mode;
    viewer_->setShading(shading);
}

void ViewSession::exportComparison() {
    if (!compared_) return note("nothing is compared yet");
    ComparedSurfaces compared = compared_->shown.measured->compared;
    compared.range = compared_->shown.range;
    if (unit()) compared.unit = unit()->name;
    const Deviation& deviation = compared_->shown.measured->deviation;
    const auto nameOf = [](int number) { return fmt::format("deviation-{}", number); };
    const std::string name =
        nameOf(freeNumber([&](int i) { return isThere(nameOf(i) + ".csv") || isThere(nameOf(i) + ".json"); }));
    auto figures = deviationJson(deviation, compared, "a_to_b");
    if (const auto& back = compared_->shown.measured->back) figures.update(deviationJson(*back, compared, "b_to_a"));
    const std::string text = figures.dump(2) + "\n";
    const auto table =
        writeFile(name + ".csv", OutputKind::Text, std::string_view(deviationCsv(deviation, compared.range)));
    const auto json = writeFile(name + ".json", OutputKind::JsonText, std::string_view(text));
    if (!table || !json) return say((table ? json : table).error().line());
    note(fmt::format("written: {}.csv and .json in {}", name, workingFolder()));
}

}  // namespace vcp
