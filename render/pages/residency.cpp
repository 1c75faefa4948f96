#include "render/pages/residency.h"

#include <limits>
#include <utility>

#include "render/pages/scene_residency.h"

namespace vcp {

Residency::ViewCut& Residency::current(ViewNumber number) {
    ViewCut& cut = cuts_[number];
    if (cut.version != version() && scene_.policy_->hasLooked(number, number_))
        take(scene_.policy_->drawable(number, number_), cut);
    return cut;
}

void Residency::take(DrawableCut drawable, ViewCut& cut) {
    const bool hasOtherPages = cut.number == 0 || drawable.cut != cut.pages || drawable.partial != cut.partial;
    if (hasOtherPages || cut.imagesVersion != imagesVersion()) cut.number = ++cutsDrawn_;
    if (hasOtherPages) cut.pagesNumber = cut.number;
    cut.imagesVersion = imagesVersion();
    cut.pages = std::move(drawable.cut);
    cut.partial = std::move(drawable.partial);
    cut.pagesUnseen = drawable.pagesUnseen;
    cut.version = version();
}

UpdateResult Residency::cutOf(const SelectionView& view, const DrawableCut& drawable, ViewNumber number) {
    ViewCut& cut = cuts_[number];
    if (cut.view != view) cut.answered = 0;
    cut.view = view;
    take(drawable, cut);
    UpdateResult result = report(drawable, cut);
    result.settled = result.settled && (!images_ || images_->isComplete(number));
    result.relaxed = result.relaxed || (images_ && images_->isLimited(number));
    result.changed = std::exchange(cut.reported, cut.number) != cut.number;
    return result;
}

UpdateResult Residency::report(const DrawableCut& drawable, const ViewCut& drawn) const {
    UpdateResult result;
    result.awaitsRays = drawable.complete && drawn.pagesUnseen > 0 && drawn.answered != drawn.pagesNumber;
    result.settled = drawable.complete && !result.awaitsRays;
    const std::vector<uint64_t>& cut = drawable.cut;
    result.drawable = !cut.empty();
    result.relaxed = drawable.isRelaxed;
    const bool isCertified = dataset().header.method == Method::Certified;
    result.errorPixels = isCertified ? drawable.errorPixels : std::numeric_limits<double>::infinity();
    result.colourPixels = drawable.colourPixels;
    result.pagesInCut = uint32_t(cut.size());
    result.pagesWanted = uint32_t(drawable.pagesWanted);
    result.pagesMissing = uint32_t(drawable.pagesMissing);
    if (cut.empty()) return result;
    // Pages are numbered level by level, coarsest first.
    result.coarsestLevel = dataset().pages[cut.front()].level;
    result.finestLevel = dataset().pages[cut.back()].level;
    return result;
}

void Residency::forgetView(ViewNumber number) {
    scene_.policy_->forgetView(number, number_);
    if (images_) images_->forgetView(number);
    cuts_.erase(number);
}

bool Residency::listens() const { return scene_.listens_[number_]; }

void Residency::hear(const RayFeedback& feedback, const SelectionView& view) {
    scene_.policy_->hear(feedback, view, number_);
}

void Residency::see(const PagesHit& hit, const SelectionView& view, uint64_t pagesNumber, ViewNumber number) {
    scene_.policy_->see(hit, view, number, number_);
    if (const auto cut = cuts_.find(number); cut != cuts_.end() && cut->second.view == view)
        cut->second.answered = pagesNumber;
}

void Residency::surroundWith(uint64_t others, ViewNumber number) {
    ViewCut& cut = current(number);
    if (std::exchange(cut.others, others) != others) cut.answered = 0;
}

bool Residency::hasAll(const std::vector<uint64_t>& pages) const { return scene_.policy_->hasAll(pages, number_); }
uint64_t Residency::version() const { return scene_.policy_->version(number_) + imagesVersion(); }

const PageMemory& Residency::pages() const { return scene_.pages(); }

PoolSlot Residency::slotOf(uint64_t page) const {
    return scene_.policy_->slotOf(scene_.policy_->numbers().firstPage(number_) + page);
}

std::vector<uint64_t> Residency::residentPages() const { return scene_.policy_->residentPages(number_); }

uint64_t Residency::colourBytes() const {
    uint64_t bytes = 0;
    if (hasColour())
        for (const uint64_t page : residentPages()) bytes += dataset().pages[page].colourBytes;
    return bytes;
}

std::vector<frame::TableRecord> Residency::table(ViewNumber number) {
    const uint64_t first = scene_.policy_->numbers().firstPage(number_);
    return pageTable(dataset(), cut(number), partial(number), [&](uint64_t page) -> std::optional<ResidentPage> {
        if (!scene_.policy_->isResident(first + page)) return {};
        const auto texel = uint32_t(slotOf(page).firstUnit * (kPoolUnitBytes / 16));
        const PageEntry& entry = dataset().pages[page];
        const bool colour = hasColour() && entry.colourBytes > 0;
        const SceneResidency::PageRoot& root = scene_.roots_.at(first + page);
        return ResidentPage{
            .header = root.header,
            .octants = root.octants,
            .texel = texel,
            .colourTexel = colour ? texel + entry.pageBytes / 16 : 0,
            .hasPoints = colour && dataset().hasImages() && entry.colourBytes != colourPageBytes(root.header)};
    });
}

}  // namespace vcp
