// The frame's page tree.
#include "render/pages/page_table.h"

#include <bit>

#include <gtest/gtest.h>

#include "render/shared/frame.h"
#include "tests/support/analytic_page.h"

namespace vcp {
namespace {

test::AnalyticDataset sphereDataset() {
    test::AnalyticOptions o;
    o.levels = 3;
    return test::analyticDataset(test::sphere(glm::dvec3(32.1, 31.9, 32.2), 25), o);
}

TEST(PageTable, LeadsToEveryPageOfTheCutAndNoOther) {
    const test::AnalyticDataset made = sphereDataset();
    const Dataset& dataset = made.dataset;
    // Level 1, but page 1 replaced by its children.
    std::vector<uint64_t> cut;
    for (uint64_t page = 0; page < dataset.pages.size(); ++page) {
        if (dataset.pages[page].level == 1 && page != 1) cut.push_back(page);
        if (page >= dataset.pages[1].firstChild &&
            page < dataset.pages[1].firstChild + uint64_t(std::popcount(dataset.pages[1].childMask)))
            cut.push_back(page);
    }
    std::vector<ResidentPage> resident(dataset.pages.size());
    for (uint64_t page = 0; page < resident.size(); ++page) {
        std::memcpy(&resident[page].header, made.pages[page].geometryBytes().data(), sizeof(PageHeader));
        resident[page].texel = uint32_t(1000 * page);
    }
    const auto table = pageTable(dataset, cut, {}, [&](uint64_t page) { return std::optional(resident[page]); });

    std::vector<uint64_t> found;
    const std::function<void(uint32_t, uint64_t)> walk = [&](uint32_t node, uint64_t page) {
        const auto& [record, sections, colours] = table[node];
        if ((record.flags & frame::kRecordInCut) != 0) {
            const PageSections bytes = pageSections(resident[page].header);
            EXPECT_EQ(record.root, resident[page].header.root);
            EXPECT_EQ(record.pageTexel, 1000 * page);
            EXPECT_EQ(sections.faces, 1000 * page + bytes.faces / 16);
            EXPECT_EQ(sections.normals, 1000 * page + bytes.normals / 16);
            EXPECT_EQ(colours.entry, page);
            found.push_back(page);
            return;
        }
        EXPECT_EQ(record.flags & 255u, dataset.pages[page].childMask);
        uint32_t child = record.firstChild;
        uint64_t childPage = dataset.pages[page].firstChild;
        for (uint32_t octant = 0; octant < 8; ++octant)
            if ((record.flags >> octant & 1) != 0) walk(child++, childPage++);
    };
    walk(0, 0);
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, cut);
}

TEST(PageTable, AnOctantOfAPageIsInThePlaceOfItsChild) {
    const test::AnalyticDataset made = sphereDataset();
    const Dataset& dataset = made.dataset;
    // The root, but one octant replaced by the child there, which is drawn in two octants and nowhere else.
    const uint64_t child = childIn(dataset.pages[0], 3);
    const auto own = uint8_t(dataset.pages[0].childMask & 0xf7),
               childOwn = uint8_t(dataset.pages[child].childMask & 0x11);
    ASSERT_EQ(std::popcount(childOwn), 2);
    const std::vector<uint64_t> cut{0, child};
    const std::vector<PartialPage> partial{{0, own}, {child, childOwn}};
    const auto table = pageTable(dataset, cut, partial, [&](uint64_t page) {
        ResidentPage resident;
        std::memcpy(&resident.header, made.pages[page].geometryBytes().data(), sizeof(PageHeader));
        resident.texel = uint32_t(1000 * page);
        for (uint32_t octant = 0; octant < 8; ++octant) resident.octants[octant] = uint32_t(100 * page + octant);
        return std::optional(resident);
    });
    ASSERT_EQ(table.size(), 1 + 8 + 2u);
    const auto expectOctant = [&](const frame::TableRecord& record, uint64_t page, uint32_t octant) {
        EXPECT_EQ(record.node.flags & ~frame::kRecordErrorMask,
                  frame::kRecordInCut | frame::kRecordResident | frame::kRecordIsOctant);
        EXPECT_EQ(record.node.root, 100 * page + octant);
        EXPECT_EQ(record.node.pageTexel, 1000 * page);
        EXPECT_EQ(record.colours.entry, page);
        EXPECT_EQ(record.colours.asked, childIn(dataset.pages[page], octant));
    };
    EXPECT_EQ(table[0].node.flags & 255, 255u);
    for (uint32_t octant = 0; octant < 8; ++octant)
        if (octant != 3) expectOctant(table[1 + octant], 0, octant);
    EXPECT_EQ(table[4].node.flags & 255, childOwn);
    EXPECT_EQ(table[4].node.flags & frame::kRecordInCut, 0u);
    EXPECT_EQ(table[4].node.firstChild, 9u);
    expectOctant(table[9], child, 0);
    expectOctant(table[10], child, 4);
}

TEST(PageTable, WithoutACutTheRootIsEmpty) {
    const auto table =
        pageTable(sphereDataset().dataset, {}, {}, [](uint64_t) -> std::optional<ResidentPage> { std::abort(); });
    ASSERT_EQ(table.size(), 1u);
    EXPECT_EQ(table[0].node.flags, 0u);
}

}  // namespace
}  // namespace vcp
