// Pages and files of the method `paper`: what is checked before a march may read them.
#include <cstring>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "octree/page/paper_page.h"
#include "octree/reference_caster.h"
#include "octree/vcp_verify.h"
#include "octree/vcp_writer.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

constexpr uint32_t kLog2Cells = 3;

/// Two roots of 4 cells: the first has an empty child, six leaves and an inner child of leaves; the second is empty.
PageBytes smallPaperPage() {
    PaperPageHeader h;
    h.rootLevel = 2;
    h.roots[0] = 2;
    h.roots[1] = h.roots[2] = 1;
    h.nodes = 2 + 8 + 8;
    h.slices = 3;
    h.cutoff = 10;
    h.longest = 2;
    h.leaves = 6 + 8;
    h.emptyNodes = 2;
    std::vector<int32_t> nodes = {2, paper::kPaperEmpty + 5, paper::kPaperEmpty, 10};
    for (int i = 0; i < 14; ++i) nodes.push_back(-1 - i % 2);
    const PaperSections sections = paperSections(h);
    PageBytes page;
    page.geometry.resize(sections.end / 16);
    auto* out = reinterpret_cast<std::byte*>(page.geometry.data());
    std::memcpy(out, &h, sizeof h);
    std::memcpy(out + sizeof h, nodes.data(), nodes.size() * 4);
    return page;
}

TEST(PaperPage, ItsPartsAreFound) {
    const PageBytes page = smallPaperPage();
    const auto view = parsePaperPage(page.geometryBytes(), kLog2Cells);
    ASSERT_TRUE(view) << view.error().line();
    EXPECT_EQ(view->nodes.size(), 18u);
    EXPECT_EQ(view->slices.size(), 3u);
    EXPECT_EQ(reinterpret_cast<const std::byte*>(view->slices.data()) - page.geometryBytes().data(), 64 + 80);
}

TEST(PaperPage, WrongPagesAreRefused) {
    const auto refuses = [](const char* what, size_t byte, auto value) {
        PageBytes page = smallPaperPage();
        std::memcpy(reinterpret_cast<std::byte*>(page.geometry.data()) + byte, &value, sizeof value);
        EXPECT_FALSE(parsePaperPage(page.geometryBytes(), kLog2Cells)) << what;
    };
    const auto node = [](size_t i) { return 64 + 4 * i; };
    refuses("magic", 0, 7u);
    refuses("root level", 4, 21u);
    refuses("roots beyond the cube", 4, 3u);
    refuses("packing", 8, 2u);
    refuses("node count", 12, 17u);
    refuses("roots", 16, 0u);
    refuses("roots that overflow", 16, 0x10000u);
    refuses("slices", 28, 4u);
    refuses("cut-off", 32, std::numeric_limits<float>::quiet_NaN());
    refuses("longest", 36, 0.0f);
    refuses("leaves", 40, 13u);
    refuses("empty nodes", 44, 3u);
    refuses("cells larger than the cube", 48, 4u);
    refuses("roots of larger cells beyond the cube", 48, 1u);
    refuses("reserved", 52, 1u);
    refuses("leaf beyond the slices", node(4), -3);
    refuses("the least leaf", node(4), std::numeric_limits<int32_t>::min());
    refuses("children that are roots", node(0), 1);
    refuses("children before their parent", node(3), 2);
    refuses("children not at a group", node(0), 3);
    refuses("children beyond the nodes", node(0), 18);
    refuses("children of a cell", node(10), 10);
    refuses("one group twice", node(1), 2);
    EXPECT_FALSE(parsePaperPage(smallPaperPage().geometryBytes().first(160), kLog2Cells));
    EXPECT_FALSE(parsePaperPage(smallPaperPage().geometryBytes().first(16), kLog2Cells));
    EXPECT_FALSE(parsePaperPage(smallPaperPage().geometryBytes(), kLog2Cells - 1));
}

TEST(PaperPage, EveryFlippedBitIsReadOrRefused) {
    for (size_t bit = 0; bit < smallPaperPage().geometryBytes().size() * 8; ++bit) {
        PageBytes page = smallPaperPage();
        reinterpret_cast<uint8_t*>(page.geometry.data())[bit / 8] ^= uint8_t(1u << bit % 8);
        const auto view = parsePaperPage(page.geometryBytes(), kLog2Cells);
        if (!view) continue;
        for (const int32_t word : view->nodes) {
            const bool isLeaf = word < 0, isInner = word >= 0 && word < paper::kPaperEmpty;
            EXPECT_TRUE(!isLeaf || uint32_t(-(word + 1)) + 1 < view->slices.size()) << bit;
            EXPECT_TRUE(!isInner || size_t(word) + 8 <= view->nodes.size()) << bit;
        }
    }
}

class PaperFileTest : public testing::Test {
protected:
    PaperFileTest() : folder_("vcp_paper_file_test") {}

    std::filesystem::path write(const std::function<void(FileHeader&)>& change) {
        FileHeader header;
        header.method = Method::Paper;
        header.cell = 1;
        header.levels = 1;
        header.log2Cells = kLog2Cells;
        header.level[0].pages = 1;
        header.leaves = 14;
        header.paper.band = 3;
        change(header);
        const std::filesystem::path file = folder_ / "small.vcp";
        auto writer = VcpWriter::create(file, 1);
        EXPECT_TRUE(writer);
        EXPECT_TRUE((*writer)->append({.leaves = 14}, compressPage(smallPaperPage().geometryBytes(), {})));
        EXPECT_TRUE((*writer)->commit(header));
        return file;
    }
    static Error refusal(const std::filesystem::path& file) {
        const auto dataset = readDataset(**openFile(file));
        EXPECT_FALSE(dataset);
        return dataset ? Error{} : dataset.error();
    }

    TestFolder folder_;
};

TEST_F(PaperFileTest, ParametersThatNoMethodHasAreRefused) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto expectRefused = [&](uint64_t byte, const char* words, const std::function<void(FileHeader&)>& change) {
        const Error error = refusal(write(change));
        EXPECT_NE(error.line().find(words), std::string::npos) << error.line();
        EXPECT_EQ(error.byte, byte) << error.line();
    };
    constexpr uint64_t at = offsetof(FileHeader, paper);
    expectRefused(at, "band", [&](FileHeader& h) { h.paper.band = nan; });
    expectRefused(at, "band", [&](FileHeader& h) { h.paper.band = -1; });
    expectRefused(at + 4, "merge threshold", [&](FileHeader& h) { h.paper.mergeThreshold = nan; });
    expectRefused(at + 8, "rounds of growing", [&](FileHeader& h) { h.paper.growRounds = -2; });
    expectRefused(at + 12, "packing", [&](FileHeader& h) { h.paper.packing = 2; });
    expectRefused(at + 16, "merge scheme", [&](FileHeader& h) { h.paper.mergeScheme = 3; });
    expectRefused(at + 20, "empty nodes", [&](FileHeader& h) { h.paper.safeEmpty = 2; });
    expectRefused(at + 24, "reserved", [&](FileHeader& h) { h.paper.reserved[0] = 1; });
    const auto page = [&](const std::function<void(FileHeader&)>& change) {
        return verifyFile(**openFile(write(change))).error().line();
    };
    EXPECT_NE(page([](FileHeader& h) { h.paper.packing = 1; }).find("its packing differs"), std::string::npos);
    EXPECT_NE(page([](FileHeader& h) { h.leaves = 13; }).find("13 leaves, but the pages without children have 14"),
              std::string::npos);
}

TEST_F(PaperFileTest, ComesBackAndIsNoCertifiedDataset) {
    const auto file = write([](FileHeader&) {});
    const auto reader = *openFile(file);
    const auto dataset = readDataset(*reader);
    ASSERT_TRUE(dataset) << dataset.error().line();
    EXPECT_EQ(dataset->header.method, Method::Paper);
    EXPECT_EQ(dataset->header.paper.band, 3);
    const auto page = readPage(*reader, *dataset, 0, true);
    ASSERT_TRUE(page) << page.error().line();
    EXPECT_EQ(page->geometry, smallPaperPage().geometry);
    EXPECT_TRUE(verifyFile(*reader));
    const auto cache = PageCache::open(file);
    ASSERT_FALSE(cache);
    EXPECT_EQ(cache.error().code, ErrorCode::Unsupported);
    EXPECT_NE(cache.error().line().find("the paper's method"), std::string::npos) << cache.error().line();
}

/// A file with a page for each entry, whatever these say.
std::filesystem::path writePages(const std::filesystem::path& file, FileHeader header,
                                 const std::vector<PageEntry>& entries, const std::vector<PageBytes>& pages) {
    header.method = Method::Paper;
    header.cell = 1;
    header.log2Cells = 2;
    header.paper.band = 3;
    header.levels = entries.back().level + 1u;
    for (const PageEntry& entry : entries) ++header.level[entry.level].pages;
    for (uint32_t l = 1; l < header.levels; ++l)
        header.level[l].firstEntry = header.level[l - 1].firstEntry + header.level[l - 1].pages;
    auto writer = VcpWriter::create(file, entries.size());
    EXPECT_TRUE(writer);
    for (size_t i = 0; i < entries.size(); ++i)
        EXPECT_TRUE((*writer)->append(entries[i], compressPage(pages[i].geometryBytes(), {})));
    EXPECT_TRUE((*writer)->commit(header));
    return file;
}

/// One root of 2^rootLevel cells, which is empty.
PageBytes emptyPaperPage(uint32_t rootLevel, uint32_t cellShift = 0) {
    PaperPageHeader h;
    h.rootLevel = rootLevel;
    h.roots[0] = h.roots[1] = h.roots[2] = h.nodes = h.emptyNodes = 1;
    h.cutoff = h.longest = 1;
    h.cellShift = cellShift;
    PageBytes page;
    page.geometry.resize(paperSections(h).end / 16);
    std::memcpy(page.geometry.data(), &h, sizeof h);
    const int32_t word = paper::kPaperEmpty;
    std::memcpy(reinterpret_cast<std::byte*>(page.geometry.data()) + sizeof h, &word, sizeof word);
    return page;
}

TEST_F(PaperFileTest, SubvolumesThatDoNotFitAreRefused) {
    const auto file = folder_ / "cut.vcp";
    const auto line = [&](const std::vector<PageEntry>& entries, const std::vector<PageBytes>& pages) {
        FileHeader header;
        header.leaves = entries.back().leaves;
        const auto reader = openFile(writePages(file, header, entries, pages));
        EXPECT_TRUE(reader);
        const auto verified = verifyFile(**reader);
        return verified ? std::string("as it should be") : verified.error().line();
    };
    const PageEntry root{.firstChild = 1, .childMask = 1}, between{.firstChild = 2, .childMask = 1, .level = 1},
        finest{.level = 2};
    const PageBytes large = emptyPaperPage(1, 2), small = emptyPaperPage(2);
    EXPECT_EQ(line({root, between, finest}, {large, small, small}), "as it should be");
    const auto expect = [&](const char* words, const std::vector<PageEntry>& entries,
                            const std::vector<PageBytes>& pages) {
        const std::string said = line(entries, pages);
        EXPECT_NE(said.find(words), std::string::npos) << said;
        EXPECT_EQ(said.find('\n'), std::string::npos);
    };
    expect("size of the cells", {root, between, finest}, {emptyPaperPage(1, 5), small, small});
    expect("number of roots", {root, between, finest}, {emptyPaperPage(2, 3), small, small});
    expect("do not fill", {root, between, finest}, {large, small, emptyPaperPage(1)});
    expect("do not fill", {root, between, finest}, {large, small, emptyPaperPage(2, 1)});
    expect("do not fill", {root, between, finest}, {large, emptyPaperPage(3), small});
    PageEntry wrong = between;
    wrong.leaves = 3;
    expect("leaves between", {root, wrong, finest}, {large, small, small});
    wrong = between;
    wrong.childMask = 0, wrong.firstChild = 0;
    expect("leads to no subvolume", {root, wrong, finest}, {large, small, small});
    wrong = finest;
    wrong.leaves = 1;
    expect("has 0 leaves", {root, between, wrong}, {large, small, small});
    const Error tooMany = refusal(write([](FileHeader& h) { h.log2Cells = 20, h.levels = 2, h.level[1].pages = 1; }));
    EXPECT_NE(tooMany.line().find("more levels"), std::string::npos) << tooMany.line();
}

TEST_F(PaperFileTest, UnknownMethodsAreNamed) {
    const Error unknown = refusal(write([](FileHeader& h) { h.method = static_cast<Method>(9); }));
    EXPECT_EQ(unknown.code, ErrorCode::Unsupported);
    EXPECT_NE(unknown.line().find("method 9"), std::string::npos) << unknown.line();
    EXPECT_EQ(refusal(write([](FileHeader& h) { h.method = Method::Certified; })).code, ErrorCode::InvalidInput);
    EXPECT_EQ(refusal(write([](FileHeader& h) { h.log2Cells = 21; })).code, ErrorCode::InvalidInput);
    EXPECT_EQ(refusal(write([](FileHeader& h) { h.flags = kFlagColour; })).code, ErrorCode::InvalidInput);
}

}  // namespace
}  // namespace vcp
