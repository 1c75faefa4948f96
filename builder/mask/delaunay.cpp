#include "builder/mask/delaunay.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

namespace vcp {

namespace {

// The edges that are turned end with a Delaunay triangulation; rounding may let some be turned for ever.
constexpr size_t kTurnsOfEdge = 64;

class EdgeTurning {
public:
    EdgeTurning(const std::array<glm::dvec2, 3>& texels, MaskParts& parts)
        : parts_(parts), beyond_(3 * parts.triangles.size(), kNone) {
        for (const Weights& w : parts.points) at_.push_back(placeOf(texels, w));
        join();
    }

    void run() {
        std::vector<uint32_t> open;
        for (uint32_t h = 0; h < beyond_.size(); ++h)
            if (h < beyond_[h] && beyond_[h] != kNone) open.push_back(h);
        size_t left = kTurnsOfEdge * open.size();
        while (!open.empty() && left-- > 0) {
            const uint32_t h = open.back();
            open.pop_back();
            if (beyond_[h] == kNone || !isWrong(h)) continue;
            for (const uint32_t side : turn(h)) open.push_back(side);
        }
    }

private:
    static constexpr uint32_t kNone = ~0u;

    // Edge 3 t + k goes from corner k of triangle t to the next one.
    static uint32_t next(uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
    static uint32_t previous(uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }
    uint32_t& startOf(uint32_t h) { return parts_.triangles[h / 3][h % 3]; }

    void join() {
        using Edge = std::tuple<uint32_t, uint32_t, uint32_t>;  // both ends, the lower first, and its number
        std::vector<Edge> edges;
        for (uint32_t h = 0; h < beyond_.size(); ++h) {
            const auto [low, high] = std::minmax({startOf(h), startOf(next(h))});
            edges.emplace_back(low, high, h);
        }
        std::sort(edges.begin(), edges.end());
        for (size_t k = 1; k < edges.size(); ++k) {
            const auto& [low, high, h] = edges[k];
            const auto& [lowBefore, highBefore, before] = edges[k - 1];
            if (low != lowBefore || high != highBefore) continue;
            beyond_[h] = before;
            beyond_[before] = h;
        }
    }

    /// Whether the edge that ends two triangles should rather join the corners opposite.
    bool isWrong(uint32_t h) {
        const uint32_t a = startOf(h), b = startOf(next(h)), c = startOf(previous(h)),
                       d = startOf(previous(beyond_[h]));
        const auto& points = parts_.points;
        // Both new triangles have an area.
        if (turnOf(points[c], points[d], points[b]) <= 0 || turnOf(points[d], points[c], points[a]) <= 0) return false;
        // The angles at c and d are more than half a turn together: the sine of their sum is negative.
        const auto sides = [&](uint32_t corner) {
            const glm::dvec2 u = at_[a] - at_[corner], v = at_[b] - at_[corner];
            return std::pair(std::abs(u.x * v.y - u.y * v.x), glm::dot(u, v));
        };
        const auto [sineC, cosineC] = sides(c);
        const auto [sineD, cosineD] = sides(d);
        const double first = sineC * cosineD, second = cosineC * sineD;
        constexpr double kRounding = 1e-9;
        return first + second < -kRounding * (std::abs(first) + std::abs(second));
    }

    /// Lets the edge join the corners opposite. Returns the four edges around.
    std::array<uint32_t, 4> turn(uint32_t h) {
        const uint32_t g = beyond_[h];
        const uint32_t c = startOf(previous(h)), d = startOf(previous(g));
        // Triangles a b c and b a d become d b c and c a d; each keeps one of its other two edges where it is.
        const uint32_t ofH = next(h), ofG = next(g);  // b c and a d
        const uint32_t ca = previous(h), db = previous(g);
        const uint32_t beyondCa = beyond_[ca], beyondDb = beyond_[db];
        startOf(h) = d;
        startOf(g) = c;
        // Now h is d to b, ofH b to c, ca c to d; g is c to a, ofG a to d, db d to c.
        link(h, beyondDb);
        link(g, beyondCa);
        link(ca, db);
        return {h, ofH, g, ofG};
    }
    void link(uint32_t h, uint32_t g) {
        beyond_[h] = g;
        if (g != kNone) beyond_[g] = h;
    }

    MaskParts& parts_;
    std::vector<glm::dvec2> at_;
    std::vector<uint32_t> beyond_;  // of each edge: the same edge of the triangle beyond; none on the outline
};

}  // namespace

void makeDelaunay(const std::array<glm::dvec2, 3>& texels, MaskParts& parts) { EdgeTurning(texels, parts).run(); }

}  // namespace vcp
