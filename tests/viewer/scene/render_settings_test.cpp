#include "viewer/scene/render_settings.h"

#include <cmath>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "render/frame_setup.h"

namespace vcp {
namespace {

TEST(RenderSettings, ACameraIsAViewAnglesOrAFile) {
    EXPECT_EQ(parseCamera("front"), CameraChoice(View::Front));
    EXPECT_EQ(parseCamera("30,-35"), CameraChoice(ViewAngles{30, -35, 1}));
    EXPECT_EQ(parseCamera("-70,50.5,2"), CameraChoice(ViewAngles{-70, 50.5, 2}));
    EXPECT_EQ(parseCamera("eye.json"), CameraChoice(std::filesystem::path("eye.json")));
    EXPECT_EQ(parseCamera("30,35.json"), CameraChoice(std::filesystem::path("30,35.json")));
    for (const char* wrong : {"30", "30,90", "30,-90", "30,35,0", "30,35,-1", "30,35,1,1"})
        EXPECT_FALSE(parseCamera(wrong)) << wrong;
    EXPECT_TRUE(RenderSettings().isFit());
}

TEST(RenderSettings, AnglesSayWhereTheEyeIs) {
    const Box box{{-1, -2, -3}, {3, 2, 1}};
    RenderSettings settings;
    for (const UpAxis up : {UpAxis::Y, UpAxis::Z}) {
        settings.up = up;
        settings.camera = ViewAngles{30, 40, 1};
        const auto whole = settings.cameraFor(box, settings.upFor(box), {320, 200});
        ASSERT_TRUE(whole);
        const glm::dvec3 eye = glm::normalize(whole->position - box.centre());
        const double rise = up == UpAxis::Z ? eye.z : eye.y, away = up == UpAxis::Z ? eye.y : -eye.z;
        EXPECT_NEAR(std::asin(rise), glm::radians(40.0), 1e-12);
        EXPECT_NEAR(std::atan2(away, eye.x), glm::radians(30.0), 1e-12);
        for (const glm::dvec3 corner : {box.low, box.high}) {
            const auto pixel = whole->pixelOf(corner, {320, 200});
            ASSERT_TRUE(pixel);
            EXPECT_GE(std::min(pixel->x, pixel->y), 0);
            EXPECT_LE(pixel->x, 320);
            EXPECT_LE(pixel->y, 200);
        }
        settings.camera = ViewAngles{30, 40, 4};
        const auto large = settings.cameraFor(box, settings.upFor(box), {320, 200});
        ASSERT_TRUE(large);
        EXPECT_EQ(large->position, whole->position);
        EXPECT_NEAR(std::tan(large->fovY / 2) * 4, std::tan(whole->fovY / 2), 1e-12);
    }
}

TEST(RenderSettings, TheAxisThatIsAskedForGoesBeforeTheShapeAndThatBeforeTheUsualOne) {
    const Box ball{{-1, -1, -1}, {1, 1, 1}}, terrain{{0, 0, 0}, {100, 80, 10}}, statue{{0, 0, 0}, {1, 2, 1}};
    RenderSettings settings;
    EXPECT_EQ(settings.upFor(ball), UpAxis::Y);
    EXPECT_EQ(settings.upFor(terrain), UpAxis::Z);
    settings.usualUp = UpAxis::Z;
    EXPECT_EQ(settings.upFor(ball), UpAxis::Z);
    EXPECT_EQ(settings.upFor(statue), UpAxis::Y);
    settings.up = UpAxis::Y;
    EXPECT_EQ(settings.upFor(ball), UpAxis::Y);
    EXPECT_EQ(settings.upFor(terrain), UpAxis::Y);
    OpenedScene relief;
    relief.surfaces.bounds = terrain;
    relief.surfaces.surfaces.emplace_back();
    settings.up.reset();
    settings.usualUp = UpAxis::Y;
    EXPECT_EQ(settings.upFor(relief), UpAxis::Y) << "surfaces lie as they are placed";
}

TEST(RenderSettings, EachShadingHasItsName) {
    for (const char* name : kShadingNames) EXPECT_TRUE(shadingNamed(name)) << name;
    EXPECT_EQ(shadingNamed("steps"), ShadingMode::Steps);
    EXPECT_FALSE(shadingNamed("shiny"));
}

TEST(RenderSettings, SectionsInPartsOfTheBoxCountFromItsLowerSide) {
    RenderSettings settings;
    settings.sections = {*parsePlane("x<25%"), *parsePlane("z>0.5")};
    const auto planes = settings.sectionPlanes({{-1, 0, 0}, {3, 1, 1}});
    ASSERT_EQ(planes.size(), 2u);
    EXPECT_EQ(planes[0].normal, glm::dvec3(-1, 0, 0));
    EXPECT_DOUBLE_EQ(planes[0].offset, 0) << "kept is x < -1 + 25% of 4";
    EXPECT_DOUBLE_EQ(planes[1].offset, 0.5);
}

TEST(RenderSettings, AnEnvironmentStandsForTheLight) {
    RenderSettings settings;
    ASSERT_TRUE(settings.takeEnvironment());
    EXPECT_FALSE(settings.shading.environment);
    settings.environment = {"overcast", 20, 0.5f};
    ASSERT_TRUE(settings.takeEnvironment());
    ASSERT_TRUE(settings.shading.environment);
    EXPECT_EQ(settings.shading.environment->turn, 20);
    EXPECT_EQ(settings.shading.environment->strength, 0.5f);
    settings.shading.shadows = true;
    EXPECT_FALSE(areLightsOn(settings.shading) || castsShadows(settings.shading));
    settings.hasLight = true;
    ASSERT_TRUE(settings.takeEnvironment());
    EXPECT_TRUE(areLightsOn(settings.shading) && castsShadows(settings.shading));
    settings.environment.source = "nowhere.exr";
    EXPECT_EQ(settings.takeEnvironment().error().file, "nowhere.exr");
}

TEST(RenderSettings, RaysAreOthersWhereTheLightGoes) {
    FrameRequest request;
    request.shading.shadows = true;
    request.shading.occlusionRays = 4;
    const SelectionView lit = selectionView(request);
    request.shading.environment = environmentNamed("clear");
    EXPECT_NE(selectionView(request), lit);
    request.shading.lightsBeside = true;
    EXPECT_EQ(selectionView(request), lit);
}

}  // namespace
}  // namespace vcp
