#include "render/pages/scene_residency.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "octree/image_needs.h"
#include "streaming/steady_seconds.h"

namespace vcp {

Result<std::shared_ptr<SceneResidency>> SceneResidency::create(const PageMemorySource& memory,
                                                               const ResidencyOptions& options,
                                                               std::vector<SceneSource::Part> datasets) {
    std::shared_ptr<SceneResidency> made(new SceneResidency(options));
    for (const SceneSource::Part& each : datasets) {
        made->pooled_.push_back({each.dataset, options.loader.withColour && each.dataset->hasColour()});
        const size_t number = made->datasets_.size();
        auto images = each.images ? std::make_unique<ImageResidency>(each.images, options.imageBytes[number]) : nullptr;
        made->datasets_.emplace_back(*made, number, made->pooled_.back(), std::move(images));
    }
    made->listens_.resize(datasets.size());
    made->source_ = std::make_shared<const SceneSource>(std::move(datasets));
    VCP_TRY(made->createPool(memory));
    made->startLoader();
    return made;
}

void SceneResidency::startLoader() {
    if (loader_) {
        const LoaderStats stats = loader_->stats();
        past_.bytesRead += stats.bytesRead;
        past_.failures += stats.failures;
    }
    loader_.reset();
    loader_ = std::make_unique<PageLoader>(source_, options_.loader);
}

Error SceneResidency::lacksRoom(uint64_t budgetBytes, const ResidencyPolicy& policy) const {
    const bool isOne = datasets_.size() == 1;
    return {.code = ErrorCode::Limit,
            .message = fmt::format("a budget of {} bytes has no room for the coarsest page{}, which take{} {}",
                                   budgetBytes, isOne ? "" : fmt::format("s of {} datasets", datasets_.size()),
                                   isOne ? "s" : "", policy.coarsestUnits() * kPoolUnitBytes),
            .file = isOne ? source_->originOf(0).file : ""};
}

Result<void> SceneResidency::createPool(const PageMemorySource& memory) {
    for (uint64_t budget = options_.budgetBytes;; budget /= 2) {
        const PoolShape shape = poolShapeFor(pooled_, budget, memory.chunkBytes);
        if (policy_)
            policy_->setPool(shape);
        else
            policy_ = std::make_unique<ResidencyPolicy>(pooled_, shape, options_.order, options_.hiddenToo);
        if (!policy_->hasRoom()) return lacksRoom(budget, *policy_);
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
Result<std::vector<SceneResidency::CarriedPage>> SceneResidency::carryOut() {
    struct Place {
        uint8_t level;
        uint64_t page, bytes;
    };
    std::vector<Place> places;
    for (const Residency& each : datasets_) {
        for (const uint64_t page : each.residentPages()) {
            const PageEntry& entry = each.dataset().pages[page];
            places.push_back({entry.level, numbers().firstPage(each.number()) + page,
                              uint64_t{entry.pageBytes} + (each.hasColour() ? entry.colourBytes : 0)});
        }
    }
    std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.level < b.level; });
    std::vector<CarriedPage> carried;
    uint64_t room = options_.loader.heldBytes;
    for (const Place& place : places) {
        if (place.bytes > room) continue;
        room -= place.bytes;
        source_->keepWithin(room);
        carried.push_back({place.page, std::vector<std::byte>(place.bytes)});
        VCP_TRY(pool_->read(policy_->slotOf(place.page), 0, carried.back().bytes));
    }
    return carried;
}

Result<void> SceneResidency::setBudgets(const PageMemorySource& memory, uint64_t budgetBytes, uint64_t ramBytes) {
    const PoolShape shape = poolShapeFor(pooled_, budgetBytes, memory.chunkBytes);
    if (const ResidencyPolicy tried(pooled_, shape); !tried.hasRoom()) return lacksRoom(budgetBytes, tried);
    options_.budgetBytes = budgetBytes;
    options_.loader.heldBytes = ramBytes;
    startLoader();  // what the old loader held is gone
    for (const Request request : std::exchange(tooLarge_, {}))
        if (request.kind != Request::Kind::ImagePiece) policy_->restore(request);
    if (pool_ && shape.units * kPoolUnitBytes == pool_->bytes()) return {};
    // What can't be carried, for want of memory, is read again.
    auto carried = pool_ ? carryOut() : std::vector<CarriedPage>();
    VCP_TRY(rebuild(memory));
    if (carried && !carryIn(*std::move(carried))) forgetPages();
    return {};
}

Result<void> SceneResidency::carryIn(std::vector<CarriedPage> carried) {
    for (CarriedPage& page : carried) {
        VCP_TRY_ASSIGN(const auto slot, slotFor(page.page));
        if (slot) VCP_TRY(pool_->write(*slot, 0, page.bytes));
        page.bytes = {};
    }
    return pool_->flush();
}

Result<void> SceneResidency::showImages(size_t dataset, std::shared_ptr<const ImagePieces> images, uint64_t mostBytes) {
    Residency& shown = datasets_[dataset];
    auto residency = std::make_unique<ImageResidency>(images, mostBytes);
    startLoader();  // what the old loader held was read without its needs
    std::vector<uint4> bytes;
    for (const uint64_t page : shown.residentPages()) {
        const PageEntry& entry = shown.dataset().pages[page];
        const uint64_t colour = shown.hasColour() ? entry.colourBytes : 0;
        if (colour == 0) continue;
        bytes.resize((entry.pageBytes + colour) / sizeof(uint4));
        const auto all = std::as_writable_bytes(std::span(bytes));
        VCP_TRY(pool_->read(shown.slotOf(page), 0, all));
        const PageView view = viewOfChecked(all.first(entry.pageBytes), all.subspan(entry.pageBytes, colour));
        residency->learn(page, imageNeeds(images->tables(), view));
    }
    shown.images_ = std::move(residency);
    return {};
}

void SceneResidency::releasePool() {
    pool_.reset();
    forgetPages();
}

void SceneResidency::forgetPages() {
    policy_->clear();
    for (Residency& each : datasets_) each.forgetCuts();
    listens_.assign(datasets_.size(), false);
}

Result<void> SceneResidency::rebuild(const PageMemorySource& memory) {
    releasePool();
    return createPool(memory);
}

void SceneResidency::forgetView(ViewNumber number) {
    for (Residency& each : datasets_) each.forgetView(number);
    policy_->forgetView(number);
}

Result<SceneResidency::Update> SceneResidency::update(std::span<const std::optional<SelectionView>> views,
                                                      ViewNumber number) {
    std::vector<Loaded> loaded = loader_->collect(uploadBytes());
    for (const Loaded& each : loaded)
        if (!each.bytes) giveUp(each);
    policy_->look(views, steadySeconds(), number);
    if (const auto taken = takeIn(loaded); !taken) {
        forgetPages();  // a slot may hold anything
        return taken.error();
    }
    PolicyOutcome outcome = policy_->finish(number);
    for (const Wish& wish : imageWishes(views, outcome.cuts, number)) outcome.wishes.push_back(wish);
    loader_->request(std::move(outcome.wishes), uploadBytes());
    for (size_t i = 0; i < datasets_.size(); ++i)
        listens_[i] = outcome.missing[i] > 0 && options_.order == LoadOrder::Feedback;
    const LoaderStats loader = loader_->stats();
    const PolicyCounts& counts = policy_->counts();
    UpdateResult all{.settled = true};
    all.residentBytes = policy_->unitsTaken() * kPoolUnitBytes;
    all.heldBytesMax = loader.heldBytesMax;
    all.bytesRead = past_.bytesRead + loader.bytesRead;
    all.failures = past_.failures + loader.failures;
    all.loads = counts.loads;
    all.evictions = counts.evictions;
    all.reloads = counts.reloads;
    all.pagesPending = uint32_t(loader_->pending());
    all.pagesResident = uint32_t(policy_->pagesResident());
    all.problems = std::exchange(problems_, {});
    return Update{std::move(all), std::move(outcome.cuts)};
}

Result<void> SceneResidency::takeIn(std::span<const Loaded> loaded) {
    for (const Loaded& each : loaded) {
        if (!each.bytes) continue;
        if (each.request.isPage()) VCP_TRY(place(each.request.number, *each.bytes));
        if (each.request.kind == Request::Kind::ImagePiece)
            datasets_[numbers().datasetOf(each.request)].images_->take(numbers().inDataset(each.request).number,
                                                                       each.bytes->texels);
    }
    return pool_->flush();
}

void SceneResidency::giveUp(const Loaded& failed) {
    const Request request = failed.request;
    if (request.kind == Request::Kind::ImagePiece)
        datasets_[numbers().datasetOf(request)].images_->giveUp(numbers().inDataset(request).number);
    else if (!policy_->giveUp(request))
        return;
    problems_.push_back(failed.bytes.error());
    if (failed.bytes.error().code == ErrorCode::Limit) tooLarge_.push_back(request);
}

/// Forgets what evicted pages show of images, once these are more than the others; pages that come are learnt anew.
void SceneResidency::forgetEvicted(Residency& dataset) {
    constexpr size_t kFew = 256;
    if (dataset.images_->pagesKnown() < dataset.pagesKept_) return;
    const std::vector<uint64_t> resident = dataset.residentPages();
    dataset.images_->forgetOthers(resident);
    dataset.pagesKept_ = 2 * resident.size() + kFew;
}

std::vector<Wish> SceneResidency::imageWishes(std::span<const std::optional<SelectionView>> views,
                                              std::span<const DrawableCut> cuts, ViewNumber number) {
    std::vector<Wish> wishes;
    for (Residency& each : datasets_) {
        if (!each.images_) continue;
        forgetEvicted(each);
        if (const auto& view = views[each.number()])
            each.images_->look(each.dataset(), *view, cuts[each.number()].cut, number);
        else
            each.images_->forgetView(number);
        for (const Wish& wish : each.images_->wishes())
            wishes.push_back({numbers().inScene(each.number(), wish.request), wish.priority});
    }
    return wishes;
}

Result<std::optional<PoolSlot>> SceneResidency::slotFor(uint64_t page) {
    const Placement placement = policy_->place(page);
    for (const PageMove& move : placement.moves) VCP_TRY(pool_->move(move.from, move.to));
    return placement.slot;
}

Result<void> SceneResidency::place(uint64_t page, const PageBytes& bytes) {
    VCP_TRY_ASSIGN(const auto slot, slotFor(page));
    if (!slot) return {};
    const std::span geometry = bytes.geometryBytes();
    const size_t dataset = numbers().datasetOf(page);
    if (const auto& images = datasets_[dataset].images_)
        images->learn(page - numbers().firstPage(dataset), bytes.needs);
    PageRoot& root = roots_[page];
    // Pages of the other method have all they need in a header of their own, which the shader reads.
    if (pooled_[dataset].dataset->header.method == Method::Certified) {
        const PageView view = viewOfChecked(geometry, {});
        root.header = view.header;
        if (nodeType(view.header.root) == kNodeInternal)
            std::copy_n(&view.nodes[8 * (view.header.root & kNodePayloadMask)], 8, root.octants.begin());
    }
    VCP_TRY(pool_->write(*slot, 0, geometry));
    if (!bytes.colour.empty()) VCP_TRY(pool_->write(*slot, geometry.size(), bytes.colourBytes()));
    return {};
}

}  // namespace vcp
