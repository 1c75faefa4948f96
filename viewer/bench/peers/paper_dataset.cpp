#include "viewer/bench/peers/paper_dataset.h"

#include <utility>

#include "builder/paper/paper_file.h"

namespace vcp {

namespace {

class OnePage final : public PageSource {
public:
    explicit OnePage(PageBytes page) : page_(std::move(page)) {}
    Result<PageBytes> read(Request, bool) const override { return page_; }
    [[nodiscard]] uint64_t bytesToRead(Request, bool) const override { return page_.geometryBytes().size(); }

private:
    PageBytes page_;
};

}  // namespace

Result<PaperDataset> paperDataset(const PaperCaster& octree, const IndexedMesh& mesh) {
    VCP_TRY_ASSIGN(auto file, paperFile(octree, mesh));
    auto dataset = std::make_shared<Dataset>();
    dataset->header = file.header;
    dataset->pages.push_back(file.entry);
    return PaperDataset{std::move(dataset), std::make_shared<const OnePage>(std::move(file.page))};
}

}  // namespace vcp
