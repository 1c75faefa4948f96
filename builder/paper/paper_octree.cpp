#include "builder/paper/paper_octree.h"

#include <array>
#include <cmath>
#include <numbers>

#include "octree/surface/packing.h"

namespace vcp {

namespace {

/// The sines and cosines of all azimuths and polar angles that have a code.
struct AngleTables {
    std::array<float, 512> sinTheta, cosTheta;
    std::array<float, 1024> sinPhi, cosPhi;
    AngleTables() {
        for (int i = 0; i < 512; ++i) {
            const double theta = (i / 511.0 - 0.5) * std::numbers::pi;
            sinTheta[i] = float(std::sin(theta));
            cosTheta[i] = float(std::cos(theta));
        }
        for (int i = 0; i < 1024; ++i) {
            const double phi = i / 1023.0 * 2 * std::numbers::pi;
            sinPhi[i] = float(std::sin(phi));
            cosPhi[i] = float(std::cos(phi));
        }
    }
};
const AngleTables kAngles;

uint32_t packOctahedral(glm::vec3 v, float longest) {
    const float r = glm::length(v);
    if (!(r > 0)) return 0;
    const float norm = std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
    glm::vec2 o = glm::vec2(v.x, v.y) / norm;
    if (v.z < 0) o = (1.0f - glm::abs(glm::vec2(o.y, o.x))) * glm::vec2(o.x >= 0 ? 1 : -1, o.y >= 0 ? 1 : -1);
    const auto quantized = [](float unit, int steps) {
        return uint32_t(std::lround(std::clamp(unit, 0.0f, 1.0f) * float(steps)));
    };
    return quantized(std::sqrt(r / longest), 8191) | quantized(o.x * 0.5f + 0.5f, 1023) << 13 |
           quantized(o.y * 0.5f + 0.5f, 511) << 23;
}

LeafVectors vectorsAt(const CornerSamples& samples) {
    LeafVectors vectors;
    for (int k = 0; k < 8; ++k) {
        const glm::vec3 v = samples[size_t((k >> 2) | (k & 1) << 1 | (k & 2) << 1)].toSurface;
        vectors.x[k] = v.x, vectors.y[k] = v.y, vectors.z[k] = v.z;
    }
    return vectors;
}

class VectorField final : public CornerField {
public:
    explicit VectorField(const PaperOptions& options) : options_(options) {}
    [[nodiscard]] float band() const override { return options_.band; }
    [[nodiscard]] bool isSigned() const override { return false; }
    [[nodiscard]] float mergeThreshold() const override { return options_.mergeThreshold; }
    [[nodiscard]] float mergeError(const CornerSamples& corners, float size, glm::vec3 at,
                                   const CornerSample& exact) const override {
        return vectorMergeError(corners, size, at, exact, options_.mergeScheme);
    }
    [[nodiscard]] uint32_t pack(const CornerSample& sample, float largest) const override {
        return packPaperVector(sample.toSurface, largest, options_.packing);
    }

private:
    const PaperOptions& options_;
};

}  // namespace

glm::vec3 interpolateVectors(const LeafVectors& corners, float size, glm::vec3 at, PaperScheme scheme) {
    return paper::interpolateVectors(corners, size, at, uint32_t(scheme));
}

float vectorMergeError(const CornerSamples& corners, float size, glm::vec3 at, const CornerSample& exact,
                       PaperScheme scheme) {
    return glm::distance(interpolateVectors(vectorsAt(corners), size, at, scheme), exact.toSurface);
}

uint32_t packPaperVector(glm::vec3 v, float longest, PaperPacking packing) {
    return packing == PaperPacking::Spherical ? packVectorSpherical(glm::dvec3(v), longest)
                                              : packOctahedral(v, longest);
}

glm::vec3 PaperDecoder::spherical(uint32_t code) {
    const uint32_t theta = code >> 13 & 511u, phi = code >> 22;
    const float c = kAngles.cosTheta[theta];
    return {c * kAngles.cosPhi[phi], c * kAngles.sinPhi[phi], kAngles.sinTheta[theta]};
}

LeafVectors PaperDecoder::leaf(const uint32_t* codes) const {
    LeafVectors vectors;
    for (int k = 0; k < 8; ++k) {
        const glm::vec3 v = (*this)(codes[k]);
        vectors.x[k] = v.x, vectors.y[k] = v.y, vectors.z[k] = v.z;
    }
    return vectors;
}

float vectorHalo(const PaperOptions& options) { return haloOf(VectorField(options), options.growRounds); }

Result<CornerOctree> buildVectorOctree(const MeshBvh& mesh, const PaperOptions& options,
                                       const CornerOctreeOptions& build) {
    CornerOctreeOptions structure = build;
    structure.growRounds = options.growRounds;
    structure.safeEmpty = options.safeEmpty;
    return buildCornerOctree(mesh, nullptr, VectorField(options), structure);
}

Result<PaperCaster> PaperCaster::create(const MeshBvh& mesh, const PaperOptions& options,
                                        const CornerOctreeOptions& build) {
    VCP_TRY_ASSIGN(auto tree, buildVectorOctree(mesh, options, build));
    return PaperCaster(std::move(tree), options);
}

}  // namespace vcp
