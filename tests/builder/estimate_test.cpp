#include "builder/estimate.h"

#include <vector>

#include <gtest/gtest.h>

namespace vcp {
namespace {

TEST(Estimate, NeedsOnOneDiskAreAddedUp) {
    const std::filesystem::path folder = testing::TempDir();
    const uint64_t part = freeBytesAt(folder) / 10 * 6;
    const SpaceNeed temporary{folder / "scan.vcp.build", part, "temporary folder"},
        output{folder / "scan.vcp", part, "folder"};
    EXPECT_TRUE(checkFreeSpace(std::vector{temporary}).ok());
    EXPECT_TRUE(checkFreeSpace(std::vector{output}).ok());
    const auto both = checkFreeSpace(std::vector{temporary, output});
    ASSERT_FALSE(both.ok());
    EXPECT_EQ(both.error().code, ErrorCode::Limit);
    EXPECT_NE(both.error().message.find("and elsewhere on its disk"), std::string::npos) << both.error().message;
    const auto one = checkFreeSpace(std::vector<SpaceNeed>{{folder, part * 2, "folder"}});
    ASSERT_FALSE(one.ok());
    EXPECT_EQ(one.error().message.find("elsewhere"), std::string::npos) << one.error().message;
}

SoupMeasures sheetOf(uint64_t triangles, double edge, double reach) {
    SoupMeasures m;
    m.triangles = triangles;
    m.area = double(triangles) * edge * edge / 2;
    m.length = double(triangles) * edge;
    m.boundsMin = glm::dvec3(0);
    m.boundsMax = glm::dvec3(reach, 1, 1);
    return m;
}

TEST(Estimate, CellsThatTheExtentWidensAreSaid) {
    BuildOptions options;
    EXPECT_FALSE(wideCellWarning(options, sheetOf(1000, 0.001, 100)));
    const auto warning = wideCellWarning(options, sheetOf(1000, 0.001, 1e6));
    ASSERT_TRUE(warning);
    EXPECT_NE(warning->find("reaches 1e+06 far"), std::string::npos) << *warning;
    options.cell = 1;
    EXPECT_FALSE(wideCellWarning(options, sheetOf(1000, 0.001, 1e6)));
}

}  // namespace
}  // namespace vcp
