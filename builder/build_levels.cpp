#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "builder/builder.h"
#include "builder/lattice/mesh_textures.h"
#include "builder/level/level_step.h"
#include "builder/level/vertex_step.h"

namespace vcp {

namespace {

// A level of slabs is built in runs of so many pages, with checkpoints between them.
constexpr size_t kSlabPagesPerBin = 256;

}  // namespace

void Builder::openPass() {
    const auto bins = [&](int pass) {
        return std::make_unique<RecordBins<LatticeTriangle>>(
            space_, fmt::format("level{}", pass), plan_.partitionOf(plan_.levelOf(pass)).bins(), memory_.bufferBytes);
    };
    if (plan_.isOfSlabs(pass_)) return;
    if (!files_.current) files_.current = bins(pass_);
    if (!files_.vertices && pass_ + 1 >= plan_.levels() && plan_.finest.bins() > 1)
        files_.vertices =
            std::make_unique<RecordBins<VertexImage>>(space_, "normals", plan_.finest.bins(), memory_.bufferBytes / 4);
    if (!steps()) return;
    files_.next = bins(pass_ - 1);
    if (pass_ == plan_.levels()) return;
    files_.waiting = std::make_unique<RecordBins<WaitingTriangle>>(space_, fmt::format("waiting{}", pass_),
                                                                   plan_.partitionOf(plan_.levelOf(pass_)).bins(),
                                                                   memory_.bufferBytes / 4);
}

LevelSettings Builder::settingsOf(int level) {
    LevelSettings settings = plan_.settingsOf(level, pass_ + 1 == plan_.levels());
    settings.withColour = hasColour();
    settings.buildBeside(space_, memory_.tempBytes);
    return settings;
}

double Builder::passBegins(int pass) const {
    const double first = kReadingShare + kDealingShare;
    if (pass == plan_.levels()) return first;
    return first + kVerticesShare + (1 - first - kVerticesShare - kWritingShare) * plan_.timeBefore(pass);
}

double Builder::passEnds(int pass) const { return pass == 0 ? 1 - kWritingShare : passBegins(pass - 1); }

std::string Builder::stageOf(int pass) const {
    if (pass == plan_.levels()) return "sorting";
    return fmt::format("level {} of {}", plan_.levels() - pass, plan_.frame.levels);
}

size_t Builder::binsOfPass() {
    if (pass_ < 0) return 0;
    if (plan_.isOfSlabs(pass_)) return binsOf(siblingsBelow());
    return plan_.partitionOf(plan_.levelOf(pass_)).bins();
}

size_t Builder::binsOf(const std::vector<Siblings>& parents) {
    return (parents.size() + kSlabPagesPerBin - 1) / kSlabPagesPerBin;
}

double Builder::fractionAt(size_t bin) {
    double before = 0, all = 0;
    if (plan_.isOfSlabs(pass_)) {
        before = double(bin * kSlabPagesPerBin);
        all = double(siblingsBelow().size());
    } else {
        before = double(trianglesBefore(bin));
        all = double(files_.current->raw().total());
    }
    return passBegins(pass_) + (passEnds(pass_) - passBegins(pass_)) * before / std::max(all, 1.0);
}

uint64_t Builder::trianglesBefore(size_t bin) const {
    uint64_t triangles = 0;
    for (size_t each = 0; each < bin; ++each) triangles += files_.current->count(each);
    return triangles;
}

std::vector<Siblings> Builder::siblingsBelow() {
    PageSpool& below = files_.surfaces[size_t(pass_) + 1];
    below.sortEntries();
    return siblingsIn(below);
}

PageSpool* Builder::surfacesOf(int level) {
    return plan_.hasSlabs && level > 0 ? &files_.surfaces[size_t(level)] : nullptr;
}

Result<void> Builder::runSlabPass() {
    const std::vector<Siblings> parents = siblingsBelow();
    const PageSpool& below = files_.surfaces[size_t(pass_) + 1];
    const size_t bins = binsOf(parents);
    const double begins = passBegins(pass_), share = passEnds(pass_) - begins;
    for (size_t bin = firstBin_; bin < bins; ++bin) {
        const size_t first = bin * kSlabPagesPerBin, end = std::min(parents.size(), first + kSlabPagesPerBin);
        Result<void> result;
        arena_.execute([&] {
            result = buildSlabPages(settingsOf(pass_), below, std::span(parents).subspan(first, end - first),
                                    files_.spools[size_t(pass_)], surfacesOf(pass_), [&](double part) {
                                        const double done = double(first) + part * double(end - first);
                                        return progress(stageOf(pass_), begins + share * done / double(parents.size()));
                                    });
        });
        VCP_TRY(result);
        if (bin + 1 < bins) VCP_TRY(checkpoint("levels", bin + 1));
    }
    return endPass();
}

Result<void> Builder::runPass() {
    if (plan_.isOfSlabs(pass_)) return runSlabPass();
    if (pass_ + 1 == plan_.levels()) VCP_TRY(joinParts());
    if (!files_.next && steps()) openPass();
    const int level = plan_.levelOf(pass_);
    const PagePartition partition = plan_.partitionOf(level);
    const PageGrid grid = plan_.gridOf(level), coarser = plan_.gridOf(std::max(pass_ - 1, 0));
    const PagePartition nextPartition = plan_.partitionOf(std::max(pass_ - 1, 0));
    std::optional<LevelSink> sink;
    std::optional<LevelStep> step;
    std::optional<VertexStep> vertexStep;
    if (steps())
        sink.emplace(pass_ > level ? plan_.pages : FinestPages(coarser), nextPartition, *files_.next,
                     plan_.marginCells());
    if (sink && pass_ > level) vertexStep.emplace(grid, partition, *files_.vertices, *sink);
    if (sink && pass_ == level) step.emplace(grid, partition, *files_.waiting, *sink);
    const auto handOn = [&](size_t bin, const LatticeMesh& mesh) {
        return vertexStep ? vertexStep->run(bin, mesh) : step ? step->run(bin, mesh) : Result<void>();
    };
    const double begins = passBegins(pass_), ends = passEnds(pass_);
    const uint64_t total = std::max<uint64_t>(files_.current->raw().total(), 1);
    uint64_t done = trianglesBefore(firstBin_);
    for (size_t bin = firstBin_; bin < partition.bins(); ++bin) {
        const uint64_t count = files_.current->count(bin);
        const auto at = [&](double part) {
            return begins + (ends - begins) * (double(done) + part * double(count)) / double(total);
        };
        VCP_TRY(runBin(bin, partition.first()[bin], LevelPlan::endOf(partition, bin, level), handOn, at));
        releaseMemory();
        if (bin + 1 < partition.bins()) VCP_TRY(checkpoint("levels", bin + 1));
        done += count;
    }
    return endPass();
}

template <class HandOn, class At>
Result<void> Builder::runBin(size_t bin, uint64_t first, uint64_t end, const HandOn& handOn, At&& at) {
    const bool vertices = pass_ == plan_.levels();
    const std::string stage = stageOf(pass_);
    if (!progress(stage, at(0))) return cancelled();
    return arena_.execute([&]() -> Result<void> {
        LatticeMesh mesh = std::exchange(mesh_, {});
        if (mesh.positions.empty()) {
            VCP_TRY_ASSIGN(mesh, loadMesh(bin));
        }
        // A bin without triangles has no corner that triangles could wait for, so nothing is passed on.
        if (mesh.positions.empty()) return {};
        if (pass_ + 1 == plan_.levels() && files_.textures) {
            VCP_TRY_ASSIGN(auto known, files_.textures->load(bin));
            addTextures(mesh, std::move(known));
        }
        if (pass_ + 1 == plan_.levels()) settleNormals(mesh);
        if (!vertices)
            VCP_TRY(buildBinPages(plan_, mesh,
                                  {.pass = pass_,
                                   .first = first,
                                   .end = end,
                                   .settings = [this](int level) { return settingsOf(level); },
                                   .pages = files_.spools,
                                   .surfaces = files_.surfaces,
                                   .progress = [&](double part) { return progress(stage, at(part)); }}));
        if (!keepsMesh()) return handOn(bin, mesh);
        mesh_ = std::move(mesh);
        return {};
    });
}

Result<LatticeMesh> Builder::loadMesh(size_t bin) {
    VCP_TRY_ASSIGN(auto soup, files_.current->load(bin));
    if (pass_ < plan_.levels()) {
        if (pass_ + 1 == plan_.levels()) VCP_TRY(complete(soup, bin));
        return meshOf(soup, hasColour());
    }
    return meshWithNormals(plan_, std::move(soup), bin, hasColour(), *files_.parts);
}

Result<void> Builder::complete(std::vector<LatticeTriangle>& soup, size_t bin) {
    for (LatticeTriangle& t : soup) t.part = meshParts_->decided(t.part);
    if (!files_.vertices) return {};
    VCP_TRY_ASSIGN(auto vertices, files_.vertices->load(bin));
    if (joinVertices(soup, std::move(vertices))) return {};
    return damagedTempFile(space_.folder().path() / files_.vertices->raw().fileName());
}

Result<void> Builder::joinParts() {
    if (meshParts_) return {};
    PartNotes* const notes = files_.parts.get();
    VCP_TRY_ASSIGN(meshParts_, PartNotes::join(std::span(&notes, 1)));
    return {};
}

Result<void> Builder::endPass() {
    firstBin_ = 0;
    // What the mesh was made from stays until its pages are made: an interrupted build goes on from there.
    if (keepsMesh()) return {};
    if (files_.next) VCP_TRY(files_.next->raw().flush());
    if (files_.vertices) VCP_TRY(files_.vertices->raw().flush());
    std::unique_ptr<RecordBins<VertexImage>> joined;
    if (pass_ < plan_.levels()) joined = std::move(files_.vertices);
    std::unique_ptr<RecordBins<TexturedTriangle>> placed;
    if (pass_ < plan_.levels()) placed = std::move(files_.textures);
    auto finished = std::move(files_.current);
    auto waited = std::move(files_.waiting);
    files_.current = std::move(files_.next);
    if (plan_.isOfSlabs(pass_)) files_.neededSurfaces = size_t(pass_) + 1;
    --pass_;
    VCP_TRY(checkpoint("levels", 0, journal_.active()));
    ++pass_;
    if (finished) finished->raw().remove();
    if (waited) waited->raw().remove();
    if (joined) joined->raw().remove();
    if (placed) placed->raw().remove();
    if (plan_.isOfSlabs(pass_)) files_.surfaces[size_t(pass_) + 1].remove();
    return {};
}

}  // namespace vcp
