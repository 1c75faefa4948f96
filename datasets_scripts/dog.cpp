#include "datasets_scripts/dog.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp::scan {
namespace {

using glm::dvec2, glm::dvec3, glm::ivec3;

// Surface in square metres; surface nets have 3 triangles for each square of the grid's edge of surface, on average.
constexpr double kSurface = 2.64, kTrianglesASquare = 3.0;
constexpr double kUnit = 0.1;      // unit of texture coordinates, metres
constexpr double kFlatEnd = 0.72;  // cosine to the axis from which on a limb's end is mapped flat
constexpr double kMargin = 0.06;
constexpr size_t kPiece = 1 << 16;

/// A capsule whose radius changes; `blend`: how far it melts into what came before it.
struct Limb {
    dvec3 from, to;
    double fromRadius, toRadius, blend;
};

std::vector<Limb> makeLimbs() {
    std::vector<Limb> limbs = {
        {{0, 0.60, -0.36}, {0, 0.63, 0.30}, 0.165, 0.215, 0},      // torso
        {{0, 0.66, 0.33}, {0, 0.93, 0.57}, 0.17, 0.115, 0.12},     // neck
        {{0, 0.985, 0.60}, {0, 0.985, 0.66}, 0.135, 0.125, 0.05},  // skull
        {{0, 0.95, 0.69}, {0, 0.92, 0.85}, 0.085, 0.06, 0.08},     // snout
        {{0, 0.71, -0.47}, {0, 0.86, -0.70}, 0.055, 0.042, 0.07},  // tail
        {{0, 0.86, -0.70}, {0, 1.04, -0.76}, 0.042, 0.028, 0.05},
    };
    for (const double side : {-1.0, 1.0}) {
        const auto add = [&](dvec3 from, dvec3 to, double fromRadius, double toRadius, double blend) {
            from.x *= side, to.x *= side;
            limbs.push_back({from, to, fromRadius, toRadius, blend});
        };
        add({0.09, 1.06, 0.56}, {0.155, 0.93, 0.555}, 0.05, 0.036, 0.035);  // ear
        add({0.115, 0.55, 0.30}, {0.135, 0.30, 0.25}, 0.115, 0.062, 0.10);  // front leg
        add({0.135, 0.30, 0.25}, {0.135, 0.06, 0.29}, 0.060, 0.050, 0.05);
        add({0.135, 0.055, 0.29}, {0.135, 0.050, 0.36}, 0.054, 0.050, 0.03);  // paw
        add({0.11, 0.56, -0.34}, {0.14, 0.34, -0.27}, 0.15, 0.078, 0.11);     // hind leg
        add({0.14, 0.34, -0.27}, {0.14, 0.19, -0.44}, 0.072, 0.050, 0.05);
        add({0.14, 0.19, -0.44}, {0.14, 0.06, -0.40}, 0.048, 0.048, 0.05);
        add({0.14, 0.055, -0.40}, {0.14, 0.050, -0.32}, 0.054, 0.050, 0.03);  // paw
    }
    return limbs;
}

double distanceTo(const Limb& limb, dvec3 p) {
    const dvec3 axis = limb.to - limb.from;
    const double along = std::clamp(glm::dot(p - limb.from, axis) / glm::dot(axis, axis), 0.0, 1.0);
    return glm::length(p - limb.from - along * axis) - glm::mix(limb.fromRadius, limb.toRadius, along);
}

class Body {
public:
    [[nodiscard]] double field(dvec3 p) const {
        double d = distanceTo(limbs_[0], p);
        for (size_t i = 1; i < limbs_.size(); ++i) {
            const double other = distanceTo(limbs_[i], p), k = limbs_[i].blend,
                         h = std::max(k - std::abs(d - other), 0.0) / k;
            d = std::min(d, other) - h * h * h * k / 6;
        }
        return d;
    }
    [[nodiscard]] dvec3 gradient(dvec3 p) const {
        constexpr double kStep = 1e-4;
        dvec3 g;
        for (int axis = 0; axis < 3; ++axis) {
            dvec3 step(0);
            step[axis] = kStep;
            g[axis] = (field(p + step) - field(p - step)) / (2 * kStep);
        }
        return g;
    }
    [[nodiscard]] dvec3 onSurface(dvec3 p) const {
        for (int i = 0; i < 3; ++i) {
            const dvec3 g = gradient(p);
            p -= g * (field(p) / std::max(glm::dot(g, g), 1e-6));
        }
        return p;
    }
    [[nodiscard]] size_t nearestLimb(dvec3 p) const {
        size_t nearest = 0;
        for (size_t i = 1; i < limbs_.size(); ++i)
            if (distanceTo(limbs_[i], p) < distanceTo(limbs_[nearest], p)) nearest = i;
        return nearest;
    }
    [[nodiscard]] const std::vector<Limb>& limbs() const { return limbs_; }

private:
    std::vector<Limb> limbs_ = makeLimbs();
};

/// Makes a vertex in each cell that the surface passes through, and a quad round each grid edge that crosses it.
class SurfaceNet {
public:
    SurfaceNet(const Body& body, double edge) : body_(body), edge_(edge) {
        low_ = dvec3(INFINITY);
        dvec3 high(-INFINITY);
        for (const Limb& limb : body.limbs()) {
            const double reach = std::max(limb.fromRadius, limb.toRadius) + kMargin;
            low_ = glm::min(low_, glm::min(limb.from, limb.to) - reach),
            high = glm::max(high, glm::max(limb.from, limb.to) + reach);
        }
        count_ = ivec3(glm::ceil((high - low_) / edge)) + 1;
        values_.resize(size_t(count_.x) * size_t(count_.y) * size_t(count_.z));
        for (size_t i = 0; i < values_.size(); ++i) values_[i] = float(body_.field(low_ + edge_ * dvec3(placeOf(i))));
        vertexOf_.assign(values_.size(), kNone);
    }

    void mesh(DogMesh& made) {
        for (size_t i = 0; i < values_.size(); ++i) addVertex(i, made);
        for (size_t i = 0; i < values_.size(); ++i) addQuads(i, made);
    }

private:
    static constexpr uint32_t kNone = 0xffffffff;

    [[nodiscard]] ivec3 placeOf(size_t i) const {
        return {int(i % size_t(count_.x)), int(i / size_t(count_.x) % size_t(count_.y)),
                int(i / size_t(count_.x) / size_t(count_.y))};
    }
    [[nodiscard]] size_t at(ivec3 p) const {
        return size_t(p.x) + size_t(count_.x) * (size_t(p.y) + size_t(count_.y) * size_t(p.z));
    }

    void addVertex(size_t cell, DogMesh& made) {
        const ivec3 p = placeOf(cell);
        if (p.x + 1 == count_.x || p.y + 1 == count_.y || p.z + 1 == count_.z) return;
        dvec3 sum(0);
        int crossings = 0;
        for (int axis = 0; axis < 3; ++axis)
            for (int side = 0; side < 4; ++side) {
                ivec3 from(0), step(0);
                from[(axis + 1) % 3] = side & 1, from[(axis + 2) % 3] = side >> 1, step[axis] = 1;
                const double a = values_[at(p + from)], b = values_[at(p + from + step)];
                if ((a < 0) == (b < 0)) continue;
                sum += dvec3(from) + a / (a - b) * dvec3(step);
                ++crossings;
            }
        if (crossings == 0) return;
        vertexOf_[cell] = uint32_t(made.positions.size());
        made.positions.push_back(body_.onSurface(low_ + edge_ * (dvec3(p) + sum / double(crossings))));
    }
    void addQuads(size_t corner, DogMesh& made) const {
        const ivec3 p = placeOf(corner);
        for (int axis = 0; axis < 3; ++axis) {
            ivec3 step(0), back(0), left(0);
            step[axis] = 1, back[(axis + 1) % 3] = 1, left[(axis + 2) % 3] = 1;
            if (p[axis] + 1 == count_[axis] || p[(axis + 1) % 3] == 0 || p[(axis + 2) % 3] == 0) continue;
            const bool inside = values_[corner] < 0;
            if (inside == (values_[at(p + step)] < 0)) continue;
            std::array<uint32_t, 4> quad = {vertexOf_[at(p - back - left)], vertexOf_[at(p - left)], vertexOf_[corner],
                                            vertexOf_[at(p - back)]};
            if (!inside) std::swap(quad[1], quad[3]);
            made.triangles.push_back({quad[0], quad[1], quad[2]});
            made.triangles.push_back({quad[0], quad[2], quad[3]});
        }
    }

    const Body& body_;
    double edge_;
    dvec3 low_{0};
    ivec3 count_{0};
    std::vector<float> values_;
    std::vector<uint32_t> vertexOf_;
};

/// Moves vertices to the middle of their neighbours, and back to the surface: triangles become of like size.
void even(const Body& body, DogMesh& mesh) {
    for (int round = 0; round < 3; ++round) {
        std::vector<dvec3> sums(mesh.positions.size(), dvec3(0));
        std::vector<int> counts(mesh.positions.size(), 0);
        for (const auto& t : mesh.triangles)
            for (int k = 0; k < 3; ++k)
                sums[t[size_t(k)]] += mesh.positions[t[size_t(k + 1) % 3]], ++counts[t[size_t(k)]];
        for (size_t i = 0; i < sums.size(); ++i)
            if (counts[i] > 0)
                mesh.positions[i] = body.onSurface(0.5 * (mesh.positions[i] + sums[i] / double(counts[i])));
    }
}

/// A frame with z along a limb; x is as near as possible to straight down, where seams are seen least.
struct Chart {
    dvec3 from, x, y, z;
    double turns;  ///< units round it

    explicit Chart(const Limb& limb) : from(limb.from), z(glm::normalize(limb.to - limb.from)) {
        const dvec3 down = std::abs(z.y) > 0.8 ? dvec3(0, 0, 1) : dvec3(0, -1, 0);
        y = glm::normalize(glm::cross(z, down)), x = glm::cross(y, z);
        turns = std::max(1.0, std::round(std::numbers::pi * (limb.fromRadius + limb.toRadius) / kUnit));
    }
    /// Returns the turn from -1/2 to 1/2; the seam is where x is.
    [[nodiscard]] double turnOf(dvec3 p) const {
        return std::atan2(-glm::dot(p - from, y), -glm::dot(p - from, x)) / (2 * std::numbers::pi);
    }
    [[nodiscard]] std::array<dvec2, 3> around(const std::array<dvec3, 3>& p) const {
        std::array<dvec2, 3> uv;
        const double first = turnOf(p[0]);
        for (size_t k = 0; k < 3; ++k) {
            double turn = turnOf(p[k]);
            turn -= std::round(turn - first);
            uv[k] = {turn * turns, glm::dot(p[k] - from, z) / kUnit};
        }
        return uv;
    }
    [[nodiscard]] std::array<dvec2, 3> flat(const std::array<dvec3, 3>& p, bool isFar) const {
        std::array<dvec2, 3> uv;
        for (size_t k = 0; k < 3; ++k)
            uv[k] = dvec2(glm::dot(p[k] - from, x) * (isFar ? 1 : -1), glm::dot(p[k] - from, y)) / kUnit;
        return uv;
    }
};

void map(const Body& body, DogMesh& mesh) {
    for (const auto& t : mesh.triangles) {
        const std::array<dvec3, 3> p = {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
        const dvec3 middle = (p[0] + p[1] + p[2]) / 3.0;
        const Limb& limb = body.limbs()[body.nearestLimb(middle)];
        const Chart chart(limb);
        const double along = glm::dot(middle - limb.from, chart.z),
                     end = glm::dot(glm::normalize(body.gradient(middle)), chart.z);
        const bool isFar = along > glm::length(limb.to - limb.from),
                   isEnd = isFar ? end > kFlatEnd : along < 0 && end < -kFlatEnd;
        mesh.uvs.push_back(isEnd ? chart.flat(p, isFar) : chart.around(p));
    }
}

}  // namespace

DogMesh dog(uint64_t triangles) {
    const Body body;
    DogMesh mesh;
    SurfaceNet(body, std::sqrt(kSurface * kTrianglesASquare / double(triangles))).mesh(mesh);
    even(body, mesh);
    map(body, mesh);
    return mesh;
}

Result<void> writeObj(const DogMesh& mesh, const std::function<Result<void>(std::string_view)>& write) {
    std::string text = "# procedural dog\n";
    char line[128];
    const auto put = [&](int size) -> Result<void> {
        text.append(line, size_t(size));
        if (text.size() < kPiece) return {};
        auto written = write(text);
        text.clear();
        return written;
    };
    for (const dvec3 p : mesh.positions)
        VCP_TRY(put(std::snprintf(line, sizeof line, "v %.6f %.6f %.6f\n", p.x, p.y, p.z)));
    for (const auto& corners : mesh.uvs)
        for (const dvec2 uv : corners) VCP_TRY(put(std::snprintf(line, sizeof line, "vt %.6f %.6f\n", uv.x, uv.y)));
    for (size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& t = mesh.triangles[i];
        VCP_TRY(put(std::snprintf(line, sizeof line, "f %u/%zu %u/%zu %u/%zu\n", t[0] + 1, 3 * i + 1, t[1] + 1,
                                  3 * i + 2, t[2] + 1, 3 * i + 3)));
    }
    return write(text);
}

}  // namespace vcp::scan
