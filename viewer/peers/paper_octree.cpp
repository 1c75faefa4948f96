#include "viewer/peers/paper_octree.h"

#include <array>
#include <cmath>
#include <numbers>

#include "octree/packing.h"

namespace vcp {

namespace {

/// Sines and cosines of all azimuths and polar angles that have a code.
struct AngleTables {
    std::array<float, 512> sinTheta, cosTheta;
    std::array<float, 1024> sinPhi, cosPhi;
    AngleTables() {
        for (int i = 0; i < 512; ++i) {
            const double theta = (i / 511.0 - 0.5) * std::numbers::pi;
            sinTheta[i] = static_cast<float>(std::sin(theta));
            cosTheta[i] = static_cast<float>(std::cos(theta));
        }
        for (int i = 0; i < 1024; ++i) {
            const double phi = i / 1023.0 * 2 * std::numbers::pi;
            sinPhi[i] = static_cast<float>(std::sin(phi));
            cosPhi[i] = static_cast<float>(std::cos(phi));
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
        return static_cast<uint32_t>(std::lround(std::clamp(unit, 0.0f, 1.0f) * static_cast<float>(steps)));
    };
    return quantized(std::sqrt(r / longest), 8191) | quantized(o.x * 0.5f + 0.5f, 1023) << 13 |
           quantized(o.y * 0.5f + 0.5f, 511) << 23;
}

LeafVectors vectorsAt(const CornerSamples& samples) {
    LeafVectors vectors;
    for (int k = 0; k < 8; ++k) {
        const glm::vec3 v = samples[static_cast<size_t>((k >> 2) | (k & 1) << 1 | (k & 2) << 1)].toSurface;
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
        return vectorMergeError(corners, size, at, exact, options_.scheme);
    }
    [[nodiscard]] uint32_t pack(const CornerSample& sample, float largest) const override {
        return packPaperVector(sample.toSurface, largest, options_.packing);
    }

private:
    const PaperOptions& options_;
};

}  // namespace

glm::vec3 interpolateVectors(const LeafVectors& corners, float size, glm::vec3 at, PaperScheme scheme) {
    const float wx[2] = {1 - at.x, at.x},
                wyz[4] = {(1 - at.y) * (1 - at.z), at.y * (1 - at.z), (1 - at.y) * at.z, at.y * at.z};
    float weight[8], along[8], squared[8];
    for (int k = 0; k < 8; ++k) weight[k] = wx[k >> 2] * wyz[k & 3];
    for (int k = 0; k < 8; ++k) {
        // From the point to the corner's closest point, along the corner's vector.
        const float ox = (static_cast<float>(k >> 2) - at.x) * size, oy = (static_cast<float>(k & 1) - at.y) * size,
                    oz = (static_cast<float>(k >> 1 & 1) - at.z) * size;
        const float x = corners.x[k], y = corners.y[k], z = corners.z[k];
        squared[k] = x * x + y * y + z * z;
        along[k] = x * (x + ox) + y * (y + oy) + z * (z + oz);
    }
    glm::vec3 trilinear(0), plane(0);
    for (int k = 0; k < 8; ++k) {
        trilinear.x += weight[k] * corners.x[k];
        trilinear.y += weight[k] * corners.y[k];
        trilinear.z += weight[k] * corners.z[k];
    }
    if (scheme == PaperScheme::Trilinear) return trilinear;
    float nearest = std::numeric_limits<float>::infinity();
    int which = -1;
    for (int k = 0; k < 8; ++k) {
        if (!(squared[k] > 0)) continue;
        const float distance2 = along[k] * along[k] / squared[k];
        if (distance2 < nearest) {
            nearest = distance2;
            which = k;
        }
    }
    if (which < 0) return trilinear;
    plane = along[which] / squared[which] * glm::vec3(corners.x[which], corners.y[which], corners.z[which]);
    if (scheme == PaperScheme::MinPlane) return plane;
    return glm::dot(trilinear, trilinear) > nearest ? trilinear : plane;
}

float vectorMergeError(const CornerSamples& corners, float size, glm::vec3 at, const CornerSample& exact,
                       PaperScheme scheme) {
    return glm::distance(interpolateVectors(vectorsAt(corners), size, at, scheme), exact.toSurface);
}

uint32_t packPaperVector(glm::vec3 v, float longest, PaperPacking packing) {
    return packing == PaperPacking::Spherical ? packVectorSpherical(glm::dvec3(v), longest)
                                              : packOctahedral(v, longest);
}

PaperDecoder::PaperDecoder(float longest, PaperPacking packing)
    : packing_(packing), perStep_(std::sqrt(longest) / 8191) {}

glm::vec3 PaperDecoder::spherical(uint32_t code) const {
    const uint32_t theta = code >> 13 & 511u, phi = code >> 22;
    const float c = kAngles.cosTheta[theta];
    return {c * kAngles.cosPhi[phi], c * kAngles.sinPhi[phi], kAngles.sinTheta[theta]};
}

glm::vec3 PaperDecoder::octahedral(uint32_t code) {
    const glm::vec2 o(static_cast<float>(code >> 13 & 1023u) * (2.0f / 1023) - 1,
                      static_cast<float>(code >> 23) * (2.0f / 511) - 1);
    glm::vec3 n(o.x, o.y, 1 - std::abs(o.x) - std::abs(o.y));
    const float fold = std::max(-n.z, 0.0f);
    n.x += n.x >= 0 ? -fold : fold;
    n.y += n.y >= 0 ? -fold : fold;
    return glm::normalize(n);
}

LeafVectors PaperCaster::vectorsOf(int32_t leaf) const {
    const uint32_t* codes = tree_->leafCodes(leaf);
    LeafVectors vectors;
    for (int k = 0; k < 8; ++k) {
        const glm::vec3 v = decode_(codes[k]);
        vectors.x[k] = v.x, vectors.y[k] = v.y, vectors.z[k] = v.z;
    }
    return vectors;
}

Result<PaperCaster> PaperCaster::create(const MeshBvh& mesh, const PaperOptions& options,
                                        const CornerOctreeOptions& build) {
    auto tree = buildCornerOctree(mesh, nullptr, VectorField(options), build);
    if (!tree) return tree.error();
    return PaperCaster(std::move(*tree), options);
}

}  // namespace vcp
