#include "render/pages/residency.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace vcp {

namespace {

double steadySeconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

Result<std::unique_ptr<Residency>> Residency::create(const PageMemorySource& memory, const ResidencyOptions& options,
                                                     std::shared_ptr<const Dataset> dataset,
                                                     std::shared_ptr<const PageSource> source) {
    std::unique_ptr<Residency> made(new Residency(options));
    made->options_.loader.withColour = options.loader.withColour && dataset->hasColour();
    made->dataset_ = std::move(dataset);
    made->source_ = std::move(source);
    VCP_TRY(made->createPool(memory));
    made->startLoader();
    return made;
}

void Residency::startLoader() {
    if (loader_) {
        const LoaderStats stats = loader_->stats();
        past_.bytesRead += stats.bytesRead;
        past_.failures += stats.failures;
    }
    loader_.reset();
    loader_ = std::make_unique<PageLoader>(source_, options_.loader);
}

bool Residency::hasRoomIn(PoolShape shape) const {
    return dataset_->pages.empty() || ResidencyPolicy(dataset_, hasColour(), shape).hasRoom();
}

Result<void> Residency::createPool(const PageMemorySource& memory) {
    for (uint64_t budget = options_.budgetBytes;; budget /= 2) {
        const PoolShape shape = poolShapeFor(*dataset_, hasColour(), budget, memory.chunkBytes);
        if (policy_)
            policy_->setPool(shape);
        else
            policy_ =
                std::make_unique<ResidencyPolicy>(dataset_, hasColour(), shape, options_.order, options_.hiddenToo);
        if (!dataset_->pages.empty() && !policy_->hasRoom())
            return Error{
                .code = ErrorCode::Limit,
                .message = fmt::format("a budget of {} bytes has no room for the coarsest page, which takes {}", budget,
                                       pageUnits(dataset_->pages[0], hasColour()) * kPoolUnitBytes),
                .file = source_->name()};
        auto pool = memory.take(shape.units * kPoolUnitBytes);
        if (pool) {
            pool_ = std::move(*pool);
            return {};
        }
        // Coarser pages of all datasets are better than none.
        if (pool.error().code != ErrorCode::Device || budget / 2 < kPoolUnitBytes) return pool.error();
    }
}

/// Returns pages of the pool, coarse ones first, as many as fit into the memory for pages; the source keeps stored ones
/// in the memory that is left.
Result<std::vector<Residency::CarriedPage>> Residency::carryOut() {
    std::vector<CarriedPage> carried;
    uint64_t room = options_.loader.heldBytes;
    Result<void> done;
    policy_->forEachResident([&](uint64_t page) {
        const PageEntry& entry = dataset_->pages[page];
        const uint64_t bytes = uint64_t{entry.pageBytes} + (hasColour() ? entry.colourBytes : 0);
        if (!done || bytes > room) return;
        room -= bytes;
        source_->keepWithin(room);
        carried.push_back({page, std::vector<std::byte>(bytes)});
        done = pool_->read(policy_->slotOf(page), 0, carried.back().bytes);
    });
    if (!done) return done.error();
    return carried;
}

Result<void> Residency::setBudgets(const PageMemorySource& memory, uint64_t budgetBytes, uint64_t ramBytes) {
    const PoolShape shape = poolShapeFor(*dataset_, hasColour(), budgetBytes, memory.chunkBytes);
    if (!hasRoomIn(shape))
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a budget of {} bytes has no room for the coarsest page", budgetBytes),
                     .file = source_->name()};
    options_.budgetBytes = budgetBytes;
    options_.loader.heldBytes = ramBytes;
    startLoader();  // what the old loader held is gone
    for (const Request request : std::exchange(tooLarge_, {})) policy_->restore(request);
    if (pool_ && shape.units * kPoolUnitBytes == pool_->bytes()) return {};
    VCP_TRY_ASSIGN(auto carried, pool_ ? carryOut() : std::vector<CarriedPage>());
    VCP_TRY(rebuild(memory));
    for (CarriedPage& page : carried) {
        VCP_TRY_ASSIGN(const auto slot, slotFor(page.page));
        if (slot) VCP_TRY(pool_->write(*slot, 0, page.bytes));
        page.bytes = {};
    }
    return pool_->flush();
}

void Residency::releasePool() {
    pool_.reset();
    policy_->clear();
    cuts_.clear();  // all views are to be drawn again
    listens_ = false;
}

Result<void> Residency::rebuild(const PageMemorySource& memory) {
    releasePool();
    return createPool(memory);
}

void Residency::forgetView(ViewNumber number) {
    policy_->forgetView(number);
    cuts_.erase(number);
}

Residency::ViewCut& Residency::current(ViewNumber number) {
    ViewCut& cut = cuts_[number];
    if (cut.version != version() && policy_->hasLooked(number)) take(policy_->drawable(number), cut);
    return cut;
}

void Residency::take(DrawableCut drawable, ViewCut& cut) {
    if (cut.number == 0 || drawable.cut != cut.pages || drawable.partial != cut.partial) cut.number = ++cutsDrawn_;
    cut.pages = std::move(drawable.cut);
    cut.partial = std::move(drawable.partial);
    cut.pagesUnseen = drawable.pagesUnseen;
    cut.version = version();
}

void Residency::see(const PagesHit& hit, const SelectionView& view, uint64_t cutNumber, ViewNumber number) {
    policy_->see(hit, view, number);
    if (const auto cut = cuts_.find(number); cut != cuts_.end() && cut->second.view == view)
        cut->second.answered = cutNumber;
}

void Residency::surroundWith(uint64_t others, ViewNumber number) {
    ViewCut& cut = current(number);
    if (std::exchange(cut.others, others) != others) cut.answered = 0;
}

Result<UpdateResult> Residency::update(const SelectionView& view, ViewNumber number) {
    std::vector<Loaded> loaded = loader_->collect(uploadBytes());
    for (const Loaded& page : loaded) {
        if (page.bytes || !policy_->giveUp(page.request)) continue;
        problems_.push_back(page.bytes.error());
        if (page.bytes.error().code == ErrorCode::Limit) tooLarge_.push_back(page.request);
    }
    policy_->look(view, steadySeconds(), number);
    for (const Loaded& page : loaded) {
        if (!page.bytes || !page.request.isPage()) continue;
        if (auto placed = place(page.request.number, *page.bytes); !placed) return placed.error();
    }
    VCP_TRY(pool_->flush());
    PolicyOutcome outcome = policy_->finish(number);
    loader_->request(std::move(outcome.wishes), uploadBytes());
    listens_ = outcome.missing > 0 && options_.order == LoadOrder::Feedback;
    ViewCut& cut = cuts_[number];
    if (cut.view != view) cut.answered = 0;
    cut.view = view;
    take(outcome.drawable, cut);
    UpdateResult result = report(outcome, cut);
    result.changed = std::exchange(cut.reported, cut.number) != cut.number;
    result.problems = std::exchange(problems_, {});
    return result;
}

UpdateResult Residency::report(const PolicyOutcome& outcome, const ViewCut& drawn) const {
    const LoaderStats loader = loader_->stats();
    const PolicyCounts& counts = policy_->counts();
    UpdateResult result;
    result.awaitsRays = outcome.drawable.complete && drawn.pagesUnseen > 0 && drawn.answered != drawn.number;
    result.settled = outcome.drawable.complete && !result.awaitsRays;
    const std::vector<uint64_t>& cut = outcome.drawable.cut;
    result.drawable = !cut.empty();
    result.relaxed = outcome.drawable.isRelaxed;
    const bool isCertified = dataset_->header.method == Method::Certified;
    result.errorPixels = isCertified ? outcome.drawable.errorPixels : std::numeric_limits<double>::infinity();
    result.residentBytes = policy_->unitsTaken() * kPoolUnitBytes;
    result.heldBytesMax = loader.heldBytesMax;
    result.bytesRead = past_.bytesRead + loader.bytesRead;
    result.failures = past_.failures + loader.failures;
    result.loads = counts.loads;
    result.evictions = counts.evictions;
    result.reloads = counts.reloads;
    result.pagesPending = uint32_t(loader_->pending());
    result.pagesResident = uint32_t(policy_->pagesResident());
    result.pagesInCut = uint32_t(cut.size());
    result.pagesWanted = uint32_t(outcome.drawable.pagesWanted);
    result.pagesMissing = uint32_t(outcome.drawable.pagesMissing);
    if (cut.empty()) return result;
    // Pages are numbered level by level, coarsest first.
    result.coarsestLevel = dataset_->pages[cut.front()].level;
    result.finestLevel = dataset_->pages[cut.back()].level;
    return result;
}

Result<std::optional<PoolSlot>> Residency::slotFor(uint64_t page) {
    const Placement placement = policy_->place(page);
    for (const PageMove& move : placement.moves) VCP_TRY(pool_->move(move.from, move.to));
    return placement.slot;
}

Result<void> Residency::place(uint64_t page, const PageBytes& bytes) {
    VCP_TRY_ASSIGN(const auto slot, slotFor(page));
    if (!slot) return {};
    const std::span geometry = bytes.geometryBytes();
    PageRoot& root = roots_[page];
    // Pages of the other method have all they need in a header of their own, which the shader reads.
    if (dataset_->header.method == Method::Certified) {
        const PageView view = viewOfChecked(geometry, {});
        root.header = view.header;
        if (nodeType(view.header.root) == kNodeInternal)
            std::copy_n(&view.nodes[8 * (view.header.root & kNodePayloadMask)], 8, root.octants.begin());
    }
    VCP_TRY(pool_->write(*slot, 0, geometry));
    if (!bytes.colour.empty()) VCP_TRY(pool_->write(*slot, geometry.size(), bytes.colourBytes()));
    return {};
}

uint64_t Residency::colourBytes() const {
    uint64_t bytes = 0;
    if (hasColour()) policy_->forEachResident([&](uint64_t page) { bytes += dataset_->pages[page].colourBytes; });
    return bytes;
}

std::vector<frame::TableRecord> Residency::table(ViewNumber number) {
    return pageTable(*dataset_, cut(number), partial(number), [&](uint64_t page) -> std::optional<ResidentPage> {
        if (!policy_->isResident(page)) return {};
        const auto texel = uint32_t(slotOf(page).firstUnit * (kPoolUnitBytes / 16));
        const bool colour = hasColour() && dataset_->pages[page].colourBytes > 0;
        const PageRoot& root = roots_.at(page);
        return ResidentPage{root.header, root.octants, texel,
                            colour ? texel + dataset_->pages[page].pageBytes / 16 : 0};
    });
}

}  // namespace vcp
