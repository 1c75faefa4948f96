#include "render/residency.h"

#include <algorithm>
#include <cstring>

namespace vcp {

namespace {

constexpr uint64_t kHeldBytes = 32ull << 20;  // read, but not in the pool yet
/// Of a pool that cannot hold the dataset, what selection plans with: the rest is for fragments between
/// slots.
constexpr uint64_t kPlannedEighths = 7;

}  // namespace

Result<std::unique_ptr<Residency>> Residency::create(Device& device, PageAccess access, uint64_t budgetBytes, bool colour,
                                                     uint32_t loaderThreads, std::shared_ptr<const Dataset> dataset,
                                                     std::shared_ptr<const PageSource> source) {
    std::unique_ptr<Residency> made(new Residency);
    made->dataset_ = std::move(dataset);
    colour = colour && made->dataset_->hasColour();
    VCP_TRY(made->createPools(device, access, budgetBytes, colour));
    const size_t pages = made->dataset_->pages.size();
    made->resident_.assign(pages, 0);
    made->unavailable_.assign(pages, 0);
    made->loader_ = std::make_unique<PageLoader>(std::move(source), colour, loaderThreads, kHeldBytes);
    return made;
}

Result<void> Residency::createPools(Device& device, PageAccess access, uint64_t budgetBytes, bool colour) {
    uint64_t geometryUnits = 0, colourUnits = 0;
    for (const PageEntry& page : dataset_->pages) {
        const uint64_t c = colour ? unitsOf(page.colourBytes) : 0;
        geometryUnits += unitsOf(page.pageBytes);
        colourUnits += c;
        pageBytes_.push_back((unitsOf(page.pageBytes) + c) * kPoolUnitBytes);
    }
    const uint64_t budgetUnits = budgetBytes / kPoolUnitBytes;
    const uint64_t all = geometryUnits + colourUnits;
    budget_ = all * kPoolUnitBytes;
    if (all > budgetUnits) {
        // Both kinds shrink alike. Selection counts a page by the share of the pools that it fills most.
        const double share = double(budgetUnits) / double(all);
        const auto geometryShare = static_cast<uint64_t>(double(geometryUnits) * share);
        colourUnits = colourUnits > 0 ? budgetUnits - geometryShare : 0;
        geometryUnits = colourUnits > 0 ? geometryShare : budgetUnits;
        const uint64_t pool = (geometryUnits + colourUnits) * kPoolUnitBytes;
        budget_ = pool / 8 * kPlannedEighths;
        for (size_t i = 0; i < pageBytes_.size(); ++i) {
            const PageEntry& page = dataset_->pages[i];
            double part = double(unitsOf(page.pageBytes)) / double(std::max<uint64_t>(geometryUnits, 1));
            if (colour) part = std::max(part, double(unitsOf(page.colourBytes)) / double(std::max<uint64_t>(colourUnits, 1)));
            pageBytes_[i] = static_cast<uint64_t>(part * double(pool));
        }
    }
    auto pool = PagePool::create(device, std::max<uint64_t>(geometryUnits, 1) * kPoolUnitBytes, access);
    if (!pool) return pool.error();
    pool_ = std::move(*pool);
    if (colourUnits == 0) return {};
    auto colours = PagePool::create(device, colourUnits * kPoolUnitBytes, access);
    if (!colours) return colours.error();
    colourPool_ = std::move(*colours);
    return {};
}

Result<UpdateResult> Residency::update(const SelectionView& view) {
    ++updates_;
    UpdateResult result;
    VCP_TRY(takeIn(result));
    Selection selection = selectPages(*dataset_, view, budget_, pageBytes_, resident_, unavailable_);
    for (const WantedPage& wanted : selection.wanted)
        if (const auto at = slots_.find(wanted.page); at != slots_.end()) at->second.lastWanted = updates_;
    wish(selection);
    result.changed = selection.cut != cut_;
    cut_ = std::move(selection.cut);
    result.settled = selection.complete;
    result.drawable = !cut_.empty();
    result.errorPixels = selection.errorPixels;
    result.residentBytes = pool_->bytesTaken() + (colourPool_ ? colourPool_->bytesTaken() : 0);
    result.bytesRead = loader_->bytesRead();
    result.pagesResident = static_cast<uint32_t>(slots_.size());
    result.pagesInCut = static_cast<uint32_t>(cut_.size());
    if (!cut_.empty()) {
        // Pages are numbered level by level, coarsest first.
        const auto [first, last] = std::minmax_element(cut_.begin(), cut_.end());
        result.coarsestLevel = dataset_->pages[*first].level;
        result.finestLevel = dataset_->pages[*last].level;
    }
    result.pagesWanted = static_cast<uint32_t>(selection.wanted.size());
    return result;
}

void Residency::wish(const Selection& selection) {
    std::vector<PageRequest> wishes;
    for (const WantedPage& wanted : selection.wanted)
        if (resident_[wanted.page] == 0) wishes.push_back({wanted.page, wanted.priority});
    loader_->request(std::move(wishes));
}

Result<void> Residency::takeIn(UpdateResult& result) {
    for (const LoadedPage& loaded : loader_->collect()) {
        if (resident_[loaded.page] != 0) continue;
        if (!loaded.bytes) {
            if (unavailable_[loaded.page] == 0) result.problems.push_back(loaded.bytes.error());
            unavailable_[loaded.page] = 1;
            continue;
        }
        auto placed = place(loaded.page, *loaded.bytes);
        if (!placed) return placed.error();
        // Slots are all in use and wanted: plan with less, so that the view settles on coarser pages.
        if (!*placed) budget_ -= budget_ / 16;
    }
    return {};
}

Result<bool> Residency::place(uint64_t page, const PageBytes& bytes) {
    Slots slots;
    std::memcpy(&slots.page.header, bytes.geometryBytes().data(), sizeof(PageHeader));
    const auto allocate = [&](PagePool& pool, uint64_t size) {
        auto slot = pool.allocate(size);
        while (!slot && makeRoom()) slot = pool.allocate(size);
        return slot;
    };
    const auto geometry = allocate(*pool_, bytes.geometryBytes().size());
    if (!geometry) return false;
    slots.geometry = *geometry;
    slots.page.texel = pool_->texel(*geometry);
    if (colourPool_ && !bytes.colourBytes().empty()) {
        const auto colour = allocate(*colourPool_, bytes.colourBytes().size());
        if (!colour) {
            pool_->release(*geometry);
            return false;
        }
        slots.colour = *colour;
        slots.page.colourTexel = colourPool_->texel(*colour);
        VCP_TRY(colourPool_->write(*colour, bytes.colourBytes()));
    }
    VCP_TRY(pool_->write(*geometry, bytes.geometryBytes()));
    slots.lastWanted = updates_;
    slots_.emplace(page, slots);
    resident_[page] = 1;
    return true;
}

bool Residency::makeRoom() {
    const auto older = [&](const auto& a, const auto& b) {
        if (a.second.lastWanted != b.second.lastWanted) return a.second.lastWanted < b.second.lastWanted;
        return a.first > b.first;  // deeper levels come later in the directory
    };
    // The last selection's pages and those taken in since are in use.
    const auto oldest = std::min_element(slots_.begin(), slots_.end(), older);
    if (oldest == slots_.end() || oldest->second.lastWanted + 1 >= updates_ || oldest->first == 0) return false;
    drop(oldest->first);
    return true;
}

void Residency::drop(uint64_t page) {
    const Slots& slots = slots_.at(page);
    pool_->release(slots.geometry);
    if (colourPool_ && slots.colour.units > 0) colourPool_->release(slots.colour);
    slots_.erase(page);
    resident_[page] = 0;
}

std::vector<glm::uvec4> Residency::table() const {
    return pageTable(*dataset_, cut_, [&](uint64_t page) -> const ResidentPage& { return slots_.at(page).page; });
}

}  // namespace vcp
