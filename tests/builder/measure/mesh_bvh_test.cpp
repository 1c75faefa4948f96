// The oracle against brute force, against exact cases and, where it is installed, against Embree in robust mode.
#include "builder/measure/mesh_bvh.h"

#include <gtest/gtest.h>

#ifdef VCP_HAVE_EMBREE
#include <embree3/rtcore.h>
#endif

#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

struct RandomPoints {
    explicit RandomPoints(uint64_t seed) : random(seed) {}
    std::mt19937_64 random;
    std::uniform_real_distribution<double> unit{0, 1};
    std::normal_distribution<double> normal;
    glm::dvec3 inBox(double low, double high) {
        return glm::dvec3(low) + (high - low) * glm::dvec3(unit(random), unit(random), unit(random));
    }
    glm::dvec3 direction() { return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random))); }
};

TEST(MeshBvh, ClosestPointAgainstBruteForce) {
    for (const bool adversarial : {false, true}) {
        const IndexedMesh mesh = test::randomTriangles(700, 1, adversarial);
        const MeshBvh bvh(mesh);
        RandomPoints points(2);
        for (int i = 0; i < 3000; ++i) {
            const glm::dvec3 p = points.inBox(-0.5, 1.5);
            double nearest = kInfinity;
            for (uint64_t t = 0; t < mesh.triangles.size(); ++t) {
                const auto v = mesh.corners(t);
                nearest = std::min(nearest, glm::distance(p, closestPointOfTriangle(p, v[0], v[1], v[2])));
            }
            const auto found = bvh.nearestPoint(p);
            ASSERT_TRUE(found);
            ASSERT_EQ(found->distance, nearest) << i;
            ASSERT_NEAR(glm::distance(found->point, p), found->distance, 1e-15);
            EXPECT_TRUE(bvh.nearestPoint(p, nearest * 1.0001));
            EXPECT_FALSE(bvh.nearestPoint(p, nearest * 0.9999));
        }
    }
}

/// Closest point by dense, refined search over barycentric weights: slow and obvious.
double searchedDistance(glm::dvec3 p, const std::array<glm::dvec3, 3>& v) {
    double centreA = 0.5, centreB = 0.5, reach = 0.5, best = kInfinity;
    for (int round = 0; round < 60; ++round) {
        double bestA = centreA, bestB = centreB;
        for (int i = -4; i <= 4; ++i)
            for (int j = -4; j <= 4; ++j) {
                double a = std::clamp(centreA + reach * i / 4, 0.0, 1.0),
                       b = std::clamp(centreB + reach * j / 4, 0.0, 1.0);
                if (a + b > 1) {
                    const double sum = a + b;
                    a /= sum;
                    b /= sum;
                }
                const double d = glm::distance(p, v[0] + a * (v[1] - v[0]) + b * (v[2] - v[0]));
                if (d < best) best = d, bestA = a, bestB = b;
            }
        centreA = bestA;
        centreB = bestB;
        reach *= 0.7;
    }
    return best;
}

TEST(MeshBvh, ClosestPointOfTriangleAgainstSearch) {
    RandomPoints points(3);
    for (int i = 0; i < 2000; ++i) {
        const std::array<glm::dvec3, 3> v = {points.inBox(0, 1), points.inBox(0, 1), points.inBox(0, 1)};
        const glm::dvec3 p = points.inBox(-1, 2);
        const double found = glm::distance(p, closestPointOfTriangle(p, v[0], v[1], v[2]));
        const double searched = searchedDistance(p, v);
        ASSERT_LE(found, searched + 1e-12) << i;
        ASSERT_GE(found, searched - 1e-4) << i;
    }
}

TEST(MeshBvh, SliversPointsAndFarOrigins) {
    RandomPoints points(4);
    for (int i = 0; i < 5000; ++i) {
        // A needle of aspect 1e6 and its exact distance: that of its long edge, to within its width.
        const glm::dvec3 a = points.inBox(0, 1), b = points.inBox(0, 1);
        const glm::dvec3 c = a + (b - a) * points.unit(points.random) + points.direction() * 1e-6;
        const glm::dvec3 p = points.inBox(-1, 2);
        const double u = std::clamp(glm::dot(p - a, b - a) / glm::dot(b - a, b - a), 0.0, 1.0);
        const double edge = glm::distance(p, a + u * (b - a));
        ASSERT_NEAR(glm::distance(p, closestPointOfTriangle(p, a, b, c)), edge, 1.1e-6);
        ASSERT_EQ(closestPointOfTriangle(p, a, a, a), p + (a - p));
        // Moved to UTM coordinates: what is lost is the rounding of the coordinates alone.
        const glm::dvec3 far(483920, 3792000, 1200);
        const glm::dvec3 q = closestPointOfTriangle(p + far, a + far, b + far, c + far);
        ASSERT_NEAR(glm::distance(q, p + far), edge, 1.2e-6);
    }
}

std::optional<MeshHit> bruteHit(const IndexedMesh& mesh, glm::dvec3 o, glm::dvec3 d) {
    std::optional<MeshHit> nearest;
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        IndexedMesh one;
        for (const glm::dvec3& p : mesh.corners(t)) one.positions.push_back(p);
        one.triangles.push_back({0, 1, 2});
        const auto hit = MeshBvh(one).nearestHit(o, d);
        if (hit && (!nearest || hit->t < nearest->t)) nearest = MeshHit{hit->t, t, hit->normal};
    }
    return nearest;
}

TEST(MeshBvh, RaysAgainstEveryTriangleAlone) {
    const IndexedMesh mesh = test::randomTriangles(300, 5, true);
    const MeshBvh bvh(mesh);
    RandomPoints points(6);
    int hits = 0;
    for (int i = 0; i < 3000; ++i) {
        // At points of triangles, of which a half are thin.
        const auto v = mesh.corners(points.random() % mesh.triangles.size());
        const glm::dvec3 o = points.inBox(-1, 2),
                         d = glm::mix(v[0], glm::mix(v[1], v[2], 0.4), points.unit(points.random)) - o;
        const auto expected = bruteHit(mesh, o, d);
        const auto found = bvh.nearestHit(o, d);
        ASSERT_EQ(found.has_value(), expected.has_value()) << i;
        const auto all = bvh.allHits(o, d);
        ASSERT_EQ(found.has_value(), !all.empty());
        ASSERT_EQ(bvh.anyHit(o, d, 0, kInfinity), found.has_value());
        if (!found) continue;
        ++hits;
        ASSERT_EQ(found->t, expected->t) << i;
        ASSERT_EQ(all.front().t, found->t);
        ASSERT_FALSE(bvh.nearestHit(o, d, 0, std::nextafter(found->t, 0)));
        ASSERT_TRUE(bvh.nearestHit(o, d, found->t, found->t));
    }
    EXPECT_GT(hits, 100);
}

TEST(MeshBvh, NoRayThroughAClosedMesh) {
    // Through vertices, along edges, in planes of the grid: an odd or an even number, but never none.
    const glm::dvec3 centre(0.1, 0.2, 0.3);
    const IndexedMesh sphere = test::sphereMesh(centre, 1, 24);
    const IndexedMesh box = test::boxMesh({-1, -1, -1}, {1, 1, 1}, 8);
    RandomPoints points(7);
    for (const IndexedMesh* mesh : {&sphere, &box}) {
        const MeshBvh bvh(*mesh);
        const glm::dvec3 inside = mesh == &box ? glm::dvec3(0.25, -0.5, 0) : centre;
        for (int i = 0; i < 60000; ++i) {
            glm::dvec3 target = mesh->positions[points.random() % mesh->positions.size()];
            if (i % 2 == 1) {
                const auto v = mesh->corners(points.random() % mesh->triangles.size());
                target = glm::mix(v[0], v[1], points.unit(points.random));
            }
            const glm::dvec3 o = i % 3 == 0 ? inside : inside + (points.inBox(-0.2, 0.2));
            ASSERT_TRUE(bvh.anyHit(o, target - o, 0, kInfinity)) << i;
        }
        for (int axis = 0; axis < 3; ++axis)
            for (const double sign : {-1.0, 1.0})
                for (int i = -7; i <= 7; ++i)
                    for (int j = -7; j <= 7; ++j) {
                        glm::dvec3 o = mesh == &box ? glm::dvec3(0) : centre, d(0);
                        o[(axis + 1) % 3] += i / 16.0;
                        o[(axis + 2) % 3] += j / 16.0;
                        d[axis] = sign;
                        ASSERT_TRUE(bvh.anyHit(o, d, 0, kInfinity)) << axis << " " << i << " " << j;
                    }
    }
}

TEST(MeshBvh, EmptyMesh) {
    const IndexedMesh mesh;
    const MeshBvh bvh(mesh);
    EXPECT_FALSE(bvh.nearestPoint({0, 0, 0}));
    EXPECT_FALSE(bvh.nearestHit({0, 0, 0}, {0, 0, 1}));
    EXPECT_TRUE(bvh.allHits({0, 0, 0}, {0, 0, 1}).empty());
}

#ifdef VCP_HAVE_EMBREE

/// Embree 3 over the mesh in floats, robust.
class EmbreeOracle {
public:
    explicit EmbreeOracle(const IndexedMesh& mesh) : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* positions = static_cast<float*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.positions.size()));
        for (const glm::dvec3& p : mesh.positions)
            for (int a = 0; a < 3; ++a) *positions++ = float(p[a]);
        auto* triangles = static_cast<uint32_t*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size()));
        for (const auto& t : mesh.triangles)
            for (const uint32_t v : t) *triangles++ = v;
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }
    ~EmbreeOracle() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    EmbreeOracle(const EmbreeOracle&) = delete;
    EmbreeOracle& operator=(const EmbreeOracle&) = delete;

    /// Distance, or infinity.
    double cast(glm::dvec3 o, glm::dvec3 d) const {
        RTCRayHit r{};
        r.ray.org_x = float(o.x), r.ray.org_y = float(o.y), r.ray.org_z = float(o.z);
        r.ray.dir_x = float(d.x), r.ray.dir_y = float(d.y), r.ray.dir_z = float(d.z);
        r.ray.tfar = std::numeric_limits<float>::infinity();
        r.ray.mask = ~0u;
        r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcIntersect1(scene_, &context, &r);
        return r.hit.geomID == RTC_INVALID_GEOMETRY_ID ? kInfinity : double(r.ray.tfar);
    }

private:
    RTCDevice device_;
    RTCScene scene_;
};

/// How near the ray passes to the rim of what it may hit: the smallest distance that, moving the ray sideways,
/// changes whether there is a hit at about `t`.
bool changesNearby(const MeshBvh& bvh, glm::dvec3 o, glm::dvec3 d, double t, bool hits, double move, double slack) {
    const glm::dvec3 u = glm::normalize(glm::cross(d, std::abs(d.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0)));
    const glm::dvec3 v = glm::cross(d, u);
    for (int i = 0; i < 64; ++i) {
        const double a = test::kTwoPi * i / 64;
        for (const double scale : {1.0, 0.3})
            if (bvh.anyHit(o + scale * move * (std::cos(a) * u + std::sin(a) * v), d, t - slack, t + slack) != hits)
                return true;
    }
    return false;
}

void compareWithEmbree(const IndexedMesh& original, int rays, uint64_t seed) {
    IndexedMesh mesh = original;
    for (glm::dvec3& p : mesh.positions) p = glm::dvec3(glm::vec3(p));
    const MeshBvh bvh(mesh);
    const EmbreeOracle embree(mesh);
    const double size = glm::distance(bvh.low(), bvh.high());
    const glm::dvec3 centre = 0.5 * (bvh.low() + bvh.high());
    RandomPoints points(seed);
    int hits = 0, differ = 0, unexplained = 0;
    for (int i = 0; i < rays; ++i) {
        const glm::dvec3 o(glm::vec3(centre + points.direction() * size * (0.3 + points.unit(points.random))));
        const glm::dvec3 target = centre + points.direction() * size * 0.4 * points.unit(points.random);
        const glm::dvec3 d(glm::vec3(glm::normalize(target - o)));
        const auto ours = bvh.nearestHit(o, d);
        const double theirs = embree.cast(o, d);
        hits += ours ? 1 : 0;
        const double tolerance = 1e-5 * size;
        if (ours ? std::abs(ours->t - theirs) <= tolerance : theirs == kInfinity) continue;
        ++differ;
        // The nearer of the two answers is disputed. In exact arithmetic that must be a ray that passes a rim,
        // or a surface seen edge-on, by no more than what float rounds away.
        const double disputed = std::min(ours ? ours->t : kInfinity, theirs);
        const bool oursHits = bvh.anyHit(o, d, disputed - 10 * tolerance, disputed + 10 * tolerance);
        if (!changesNearby(bvh, o, d, disputed, oursHits, 1e-6 * size, 10 * tolerance)) ++unexplained;
    }
    EXPECT_GT(hits, rays / 50);
    EXPECT_LE(differ, rays / 2000 + 5);
    EXPECT_EQ(unexplained, 0) << "of " << differ << " that differ in " << rays;
    std::printf("embree: %d rays, %d hits, %d differ, %d unexplained\n", rays, hits, differ, unexplained);
}

TEST(MeshBvhEmbree, ClosedMeshes) {
    compareWithEmbree(test::sphereMesh({0.1, 0.2, 0.3}, 1, 100), 300000, 8);
    compareWithEmbree(test::torusMesh({0, 0, 0}, 1, 0.3, 200, 80), 300000, 9);
    compareWithEmbree(test::boxMesh({-1, -1, -1}, {1, 1, 1}, 20), 300000, 10);
}

TEST(MeshBvhEmbree, TriangleSoup) { compareWithEmbree(test::randomTriangles(20000, 11, false), 300000, 12); }

TEST(MeshBvhEmbree, Scan) {
    const std::filesystem::path scan = std::filesystem::path(VCP_SHARED_DATA_DIR) / "scans/bun_zipper_ascii.ply";
    if (!std::filesystem::exists(scan)) GTEST_SKIP() << "the scan " << scan << " is not there";
    const auto mesh = loadMesh(scan);
    ASSERT_TRUE(mesh.ok()) << mesh.error().line();
    compareWithEmbree(*mesh, 1000000, 13);
}

#endif

}  // namespace
}  // namespace vcp
