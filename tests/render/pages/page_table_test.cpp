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
    const auto table = pageTable(dataset, cut, [&](uint64_t page) { return std::optional(resident[page]); });

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

TEST(PageTable, WithoutACutTheRootIsEmpty) {
    const auto table =
        pageTable(sphereDataset().dataset, {}, [](uint64_t) -> std::optional<ResidentPage> { std::abort(); });
    ASSERT_EQ(table.size(), 1u);
    EXPECT_EQ(table[0].node.flags, 0u);
}

}  // namespace
}  // namespace vcp
