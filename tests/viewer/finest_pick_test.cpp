// Picking on the finest level, against the reference caster with all pages loaded.
#include "viewer/finest_pick.h"

#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "tests/support/built_ball.h"
#include "tests/support/meso_surfaces.h"

namespace vcp {
namespace {

class FinestPickTest : public BuiltBall {
protected:
    void SetUp() override {
        auto reader = openFile(*folder_ / "ball.vcp");
        ASSERT_TRUE(reader);
        dataset_ = readDataset(**reader).value();
        pick_ = std::make_unique<FinestPick>(*reader, dataset_);
    }

    Dataset dataset_;
    std::unique_ptr<FinestPick> pick_;
};

TEST_F(FinestPickTest, AgreesWithTheCasterOfAllFinestPages) {
    PageCache all = PageCache::open(*folder_ / "ball.vcp").value();
    const std::vector<uint64_t> cut = cutAtLevel(dataset_, dataset_.header.levels - 1);
    ASSERT_GT(cut.size(), 4u);
    ASSERT_TRUE(all.load(cut));
    const auto caster = ReferenceCaster::create(all, cut);
    ASSERT_TRUE(caster);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> range(-1.2, 1.2);
    int hits = 0;
    for (int i = 0; i < 400; ++i) {
        const glm::dvec3 from(range(random), range(random), 4), to(range(random), range(random), 0);
        const Ray ray{from, glm::normalize(to - from)};
        const auto expected = caster->cast(ray);
        const auto picked = pick_->cast(ray);
        ASSERT_TRUE(picked) << picked.error().line();
        ASSERT_EQ(picked->has_value(), expected.has_value()) << "ray " << i;
        if (!expected) continue;
        ++hits;
        EXPECT_EQ((*picked)->position, expected->position) << "ray " << i;
        EXPECT_EQ((*picked)->level, dataset_.header.levels - 1);
        EXPECT_LE((*picked)->certifiedError, dataset_.header.certifiedErrorMax);
    }
    EXPECT_GT(hits, 100);
}

TEST_F(FinestPickTest, SectionPlanesAreSeenThrough) {
    const Ray ray{{0.1, 0.1, 4}, {0, 0, -1}};
    const auto front = pick_->cast(ray);
    ASSERT_TRUE(front && *front);
    EXPECT_GT((*front)->position.z, 0.5);
    const SectionPlane keepsBack{{0, 0, -2}, 0};
    const auto back = pick_->cast(ray, std::span(&keepsBack, 1));
    ASSERT_TRUE(back && *back);
    EXPECT_LT((*back)->position.z, -0.5);
    const SectionPlane keepsFront{{0, 0, 1}, 0};
    EXPECT_EQ((*pick_->cast(ray, std::span(&keepsFront, 1)))->position, (*front)->position);
    const SectionPlane both[] = {{{0, 0, 1}, 2}, {{0, 0, -1}, 0}};
    EXPECT_FALSE(*pick_->cast(ray, both));
    const SectionPlane aside{{1, 0, 0}, 0.5};
    EXPECT_FALSE(*pick_->cast(ray, std::span(&aside, 1))) << "parallel to the ray, which it cuts away";
}

TEST_F(FinestPickTest, AMissReadsNothingAndABrokenFileIsSaid) {
    EXPECT_FALSE(*pick_->cast({{5, 5, 4}, {0, 0, -1}}));
    const auto file = *folder_ / "cut.vcp";
    std::filesystem::copy_file(*folder_ / "ball.vcp", file, std::filesystem::copy_options::overwrite_existing);
    auto reader = openFile(file).value();
    FinestPick pick(reader, dataset_);
    std::filesystem::resize_file(file, 8192);
    EXPECT_FALSE(*pick.cast({{5, 5, 4}, {0, 0, -1}}));
    const auto picked = pick.cast({{0, 0, 4}, {0, 0, -1}});
    ASSERT_FALSE(picked);
    EXPECT_NE(picked.error().line().find("cut.vcp"), std::string::npos);
}

TEST_F(FinestPickTest, TheNearestOfDatasetsAndSurfacesWithMesostructure) {
    ScenePick scene;
    scene.add(openFile(*folder_ / "ball.vcp").value(), dataset_, {});
    const std::vector<MesoSurface> surfaces = {
        test::mesoSurface(test::plateau(), "pyramid", "quad", 0.1, 2, {0, 0, -1.5})};
    const auto cast = [&](const Ray& ray, std::span<const SectionPlane> sections = {},
                          std::span<const uint32_t> hidden = {}) {
        return scene.cast(ray, sections, hidden, pickOnSurfaces(surfaces, ray.origin, ray.direction, sections));
    };
    const auto ball = cast({{0.1, 0.1, 4}, {0, 0, -1}});
    ASSERT_TRUE(ball && *ball);
    EXPECT_FALSE((*ball)->onSurface);
    EXPECT_GT((*ball)->position.z, 0.5);
    const auto behind = cast({{0.1, 0.1, -4}, {0, 0, 1}});
    ASSERT_TRUE(behind && *behind);
    EXPECT_TRUE((*behind)->onSurface);
    EXPECT_NEAR((*behind)->position.z, -1.5, 1e-5) << "the base from below";
    EXPECT_LT((*behind)->certifiedError, 1e-3);
    const SectionPlane keepsUpper{{0, 0, 1}, 0};
    const auto inside = cast({{0.1, 0.1, -4}, {0, 0, 1}}, std::span(&keepsUpper, 1));
    ASSERT_TRUE(inside && *inside);
    EXPECT_FALSE((*inside)->onSurface);
    const uint32_t hidden = 0;
    const auto through = cast({{0.1, 0.1, 4}, {0, 0, -1}}, {}, std::span(&hidden, 1));
    ASSERT_TRUE(through && *through);
    EXPECT_NEAR((*through)->position.z, -1.44, 1e-5);
}

}  // namespace
}  // namespace vcp
