#include "viewer/bench_methods.h"

#include <algorithm>

#include <fmt/format.h>

#include "viewer/peers/distance_octree.h"
#include "viewer/peers/peer_tracer.h"
#include "viewer/peers/voxel_octree.h"

namespace vcp {

namespace {

struct Method {
    std::string name;
    double knob = 0;
    std::vector<double> swept = {};
};

const std::vector<Method> kMethods = {{"certified", 0.5, {0.5, 1, 2, 4}},
                                      {"reference"},
                                      {"paper", 0.25, {0.5, 0.25, 0.1}},
                                      {"sdf", 1, {2, 1, 0.5}},
                                      {"sdf-analytic", 1, {2, 1, 0.5}},
                                      {"voxel", 1, {1, 0.5, 0.25}},
                                      {"svo-contours", 1, {2, 1, 0.5}},
                                      {"embree"},
                                      {"embree-single"}};

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
        for (const Method& method : kMethods) all.push_back(method.name);
        return all;
    }();
    return names;
}

std::vector<double> rayMethodKnobs(const std::string& method, bool sweep) {
    const auto found = std::ranges::find(kMethods, method, &Method::name);
    if (found == kMethods.end()) return {};
    return sweep && !found->swept.empty() ? found->swept : std::vector<double>{found->knob};
}

const MeshSides& RayMethods::sides() {
    if (!sides_) sides_.emplace(in_.mesh);
    return *sides_;
}

Result<std::unique_ptr<RayTracer>> RayMethods::make(const std::string& method, double knob) {
    if (method == "certified") return makeCertifiedTracer(in_.vcp, in_.device, knob);
    if (method == "reference") return makeReferenceTracer(in_.cache, in_.threads);
    if (method == "paper") return makePaper(knob);
    if (method == "sdf" || method == "sdf-analytic") return makeDistances(method == "sdf-analytic", knob);
    if (method == "voxel" || method == "svo-contours") return makeVoxels(method == "svo-contours", knob);
    return makeEmbreeTracer(in_.mesh, method == "embree", in_.threads);
}

Result<std::unique_ptr<RayTracer>> RayMethods::makePaper(double epsilon) {
    if (!paper_) {
        auto made = PaperCaster::create(in_.bvh, in_.paper, {.cell = in_.cell, .threads = in_.threads});
        if (!made) return made.error();
        paper_ = std::move(*made);
    }
    PaperCaster caster = *paper_;
    caster.setEpsilon(static_cast<float>(epsilon));
    return tracerOf(std::move(caster), fmt::format("eps {:g}", epsilon), in_.threads);
}

Result<std::unique_ptr<RayTracer>> RayMethods::makeDistances(bool analytic, double cells) {
    const CornerOctreeOptions build{.cell = in_.cell * cells, .threads = in_.threads};
    if (analytic) {
        auto made = AnalyticCaster::create(in_.bvh, sides(), build);
        if (!made) return made.error();
        return tracerOf(std::move(*made), cellKnob(cells), in_.threads);
    }
    auto made = DistanceCaster::create(in_.bvh, sides(), {}, build);
    if (!made) return made.error();
    return tracerOf(std::move(*made), cellKnob(cells), in_.threads);
}

Result<std::unique_ptr<RayTracer>> RayMethods::makeVoxels(bool contours, double cells) const {
    auto made = buildVoxelOctree(in_.mesh, in_.cell * cells, contours, in_.threads);
    if (!made) return made.error();
    return tracerOf(VoxelCaster(std::move(*made)), cellKnob(cells), in_.threads);
}

}  // namespace vcp
