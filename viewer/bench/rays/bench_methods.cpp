#include "viewer/bench/rays/bench_methods.h"

#include <algorithm>

#include <fmt/format.h>

#include "builder/paper/paper_file.h"
#include "viewer/bench/peers/distance_octree.h"
#include "viewer/bench/peers/paper_dataset.h"
#include "viewer/bench/peers/subvolume_caster.h"
#include "viewer/bench/peers/voxel_octree.h"
#include "viewer/bench/rays/peer_tracer.h"

namespace vcp {

namespace {

struct RayMethod {
    std::string name;
    double knob = 0;
    std::vector<double> swept = {};
};

const std::vector<RayMethod> kMethods = {{"certified", 0.5, {0.5, 1, 2, 4}},
                                         {"host", 0.5, {0.5, 1, 2, 4}},
                                         {"reference"},
                                         {"paper", 0.25, {0.5, 0.25, 0.1}},
                                         {"paper-onward", 0.25, {0.5, 0.25, 0.1}},
                                         {"paper-gpu", 0.25, {0.5, 0.25, 0.1}},
                                         {"paper-subvolumes", 0.25, {0.5, 0.25, 0.1}},
                                         {"paper-subvolumes-gpu", 0.25, {0.5, 0.25, 0.1}},
                                         {"paper-rules"},
                                         {"sdf", 1, {2, 1, 0.5}},
                                         {"sdf-analytic", 1, {2, 1, 0.5}},
                                         {"voxel", 1, {1, 0.5, 0.25}},
                                         {"svo-contours", 1, {2, 1, 0.5}},
                                         {"embree"},
                                         {"embree-single"}};

/// The paper's method with one rule changed. Rules of the march come first: they need no other octree.
struct PaperRule {
    const char* name;
    void (*change)(PaperOptions&);
};
constexpr PaperRule kPaperRules[] = {
    {"as published", [](PaperOptions&) {}},
    {"scheme trilinear", [](PaperOptions& o) { o.march.scheme = PaperScheme::Trilinear; }},
    {"scheme min-plane", [](PaperOptions& o) { o.march.scheme = PaperScheme::MinPlane; }},
    {"step onward", [](PaperOptions& o) { o.march.step = PaperStep::Onward; }},
    {"step distance", [](PaperOptions& o) { o.march.step = PaperStep::Distance; }},
    {"back off", [](PaperOptions& o) { o.march.back = false; }},
    {"cache off", [](PaperOptions& o) { o.march.cached = false; }},
    {"packing octahedral", [](PaperOptions& o) { o.packing = PaperPacking::Octahedral; }},
    {"k 1", [](PaperOptions& o) { o.growRounds = 1; }},
    {"k 2", [](PaperOptions& o) { o.growRounds = 2; }},
    {"k exact", [](PaperOptions& o) { o.growRounds = CornerOctreeOptions::kExactPoints; }},
    {"band halved", [](PaperOptions& o) { o.band *= 0.5f; }},
    {"merge never", [](PaperOptions& o) { o.mergeThreshold = -1; }},
    {"merge 0.2", [](PaperOptions& o) { o.mergeThreshold = 0.2f; }},
    {"empty safe", [](PaperOptions& o) { o.safeEmpty = true; }},
};

template <class Caster>
std::unique_ptr<RayTracer> tracerOf(Caster caster, std::string knob, unsigned threads) {
    return std::make_unique<PeerTracer<Caster>>(std::make_shared<const Caster>(std::move(caster)), std::move(knob),
                                                threads);
}

std::string cellKnob(double cells) { return fmt::format("cell {:g}", cells); }

}  // namespace

const std::vector<std::string>& rayMethodNames() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const RayMethod& method : kMethods) all.push_back(method.name);
        return all;
    }();
    return names;
}

bool isUsualRayMethod(const std::string& method) {
    return method != "paper-rules" && !method.starts_with("paper-subvolumes");
}

std::vector<double> rayMethodKnobs(const std::string& method, bool sweep) {
    const auto found = std::ranges::find(kMethods, method, &RayMethod::name);
    if (found == kMethods.end()) return {};
    if (method != "paper-rules")
        return sweep && !found->swept.empty() ? found->swept : std::vector<double>{found->knob};
    std::vector<double> rules;
    for (size_t i = 0; i < std::size(kPaperRules); ++i) rules.push_back(double(i));
    return rules;
}

const MeshSides& RayMethods::sides() {
    if (!sides_) sides_.emplace(in_.mesh);
    return *sides_;
}

Result<std::unique_ptr<RayTracer>> RayMethods::make(const std::string& method, double knob) {
    if (method == "certified") return makeCertifiedTracer(in_.vcp, in_.device, knob);
    if (method == "host") return makeHostTracer(in_.vcp, in_.threads, knob);
    if (method == "reference") return makeReferenceTracer(in_.cache, in_.threads);
    PaperOptions paper = in_.paper;
    if (method == "paper-rules") {
        const PaperRule& rule = kPaperRules[size_t(knob)];
        rule.change(paper);
        return makePaper(paper, rule.name);
    }
    paper.march.epsilon = float(knob);
    if (method == "paper") return makePaper(paper, fmt::format("eps {:g}", knob));
    if (method == "paper-gpu") return makePaperGpu(paper);
    if (method.starts_with("paper-subvolumes")) return makeSubvolumes(paper, method != "paper-subvolumes");
    if (method == "paper-onward") {
        paper.march.step = PaperStep::Onward;
        return makePaper(paper, fmt::format("eps {:g}", knob));
    }
    if (method == "sdf" || method == "sdf-analytic") return makeDistances(method == "sdf-analytic", knob);
    if (method == "voxel" || method == "svo-contours") return makeVoxels(method == "svo-contours", knob);
    return makeEmbreeTracer(in_.mesh, method == "embree", in_.threads);
}

/// Builds the octree anew only where another one is needed.
Result<const PaperCaster*> RayMethods::paperOf(const PaperOptions& options) {
    PaperOptions structure = options;
    if (paper_) structure.march = paper_->options().march;
    if (!paper_ || structure != paper_->options()) {
        paper_.reset();
        VCP_TRY_ASSIGN(paper_, PaperCaster::create(in_.bvh, options, {.cell = in_.cell, .threads = in_.threads}));
    }
    return &*paper_;
}

Result<std::unique_ptr<RayTracer>> RayMethods::makePaper(const PaperOptions& options, std::string knob) {
    VCP_TRY_ASSIGN(const auto made, paperOf(options));
    PaperCaster caster = *made;
    caster.setMarch(options.march);
    return tracerOf(std::move(caster), std::move(knob), in_.threads);
}

Result<std::unique_ptr<RayTracer>> RayMethods::makePaperGpu(const PaperOptions& options) {
    VCP_TRY_ASSIGN(const auto made, paperOf(options));
    VCP_TRY_ASSIGN(const auto dataset, paperDataset(*made, in_.mesh));
    return makePaperGpuTracer(dataset.dataset, dataset.source, in_.device, options.march);
}

Result<std::filesystem::path> RayMethods::subvolumesOf(const PaperOptions& options) {
    if (!subvolumes_.empty()) return subvolumes_;
    constexpr int kUsualCells = 64;
    PaperOptions paper = options;
    if (paper.subvolumeCells == 0) paper.subvolumeCells = kUsualCells;
    BuildOptions build;
    build.inputs = {in_.meshFile};
    build.output = in_.folder / (in_.meshFile.stem().string() + ".paper.vcp");
    build.cell = in_.cell;
    build.threads = in_.threads;
    VCP_TRY(buildPaperFile(build, paper));
    return subvolumes_ = build.output;
}

Result<std::unique_ptr<RayTracer>> RayMethods::makeSubvolumes(const PaperOptions& options, bool onDevice) {
    VCP_TRY_ASSIGN(const auto file, subvolumesOf(options));
    if (!onDevice) {
        VCP_TRY_ASSIGN(auto caster, SubvolumeCaster::open(file, options.march));
        return tracerOf(std::move(caster), fmt::format("eps {:g}", options.march.epsilon), in_.threads);
    }
    VCP_TRY_ASSIGN(const auto reader, openFile(file));
    VCP_TRY_ASSIGN(auto dataset, readDataset(*reader));
    const auto shared = std::make_shared<const Dataset>(std::move(dataset));
    return makePaperGpuTracer(shared, std::make_shared<FilePageSource>(reader, shared), in_.device, options.march);
}

Result<std::unique_ptr<RayTracer>> RayMethods::makeDistances(bool analytic, double cells) {
    const CornerOctreeOptions build{.cell = in_.cell * cells, .threads = in_.threads};
    if (analytic) {
        VCP_TRY_ASSIGN(auto made, AnalyticCaster::create(in_.bvh, sides(), build));
        return tracerOf(std::move(made), cellKnob(cells), in_.threads);
    }
    VCP_TRY_ASSIGN(auto made, DistanceCaster::create(in_.bvh, sides(), {}, build));
    return tracerOf(std::move(made), cellKnob(cells), in_.threads);
}

Result<std::unique_ptr<RayTracer>> RayMethods::makeVoxels(bool contours, double cells) const {
    VCP_TRY_ASSIGN(auto made, buildVoxelOctree(in_.mesh, in_.cell * cells, contours, in_.threads));
    return tracerOf(VoxelCaster(std::move(made)), cellKnob(cells), in_.threads);
}

}  // namespace vcp
