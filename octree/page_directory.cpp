#include "octree/page_directory.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "octree/dataset_reader.h"
#include "octree/directory_check.h"

namespace vcp {

namespace {

/// A lock that one thread holds at a time; others wait.
class Turn {
public:
    explicit Turn(std::atomic_flag& taken) : taken_(taken) {
        while (taken_.test_and_set(std::memory_order_acquire)) taken_.wait(true, std::memory_order_relaxed);
    }
    ~Turn() {
        taken_.clear(std::memory_order_release);
        taken_.notify_one();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

private:
    std::atomic_flag& taken_;
};

}  // namespace

/// What a directory that comes in parts must know beside its entries.
struct PageDirectory::Parts {
    explicit Parts(size_t pages) : known(blocksOf(pages)), afterParents(pages) {}
    static constexpr uint32_t kNoPage = 0;

    std::atomic_flag admitting;
    SparseArray<std::atomic<uint8_t>> known;  // for each block: 1 after its entries were written
    std::atomic<uint64_t> blocksKnown{0};
    SparseArray<uint32_t> afterParents;  // for each page 1 more than its parent; 0: not known yet
};

PageDirectory::PageDirectory() = default;
PageDirectory::PageDirectory(const PageDirectory& other) { *this = other; }
PageDirectory::PageDirectory(PageDirectory&& other) noexcept = default;
PageDirectory& PageDirectory::operator=(PageDirectory&& other) noexcept = default;
PageDirectory::~PageDirectory() = default;

PageDirectory& PageDirectory::operator=(const PageDirectory& other) {
    if (this == &other) return *this;
    parts_.reset();
    sparse_ = {};
    entries_ = other.entries_;
    if (!other.parts_) return *this;
    const Turn turn(other.parts_->admitting);
    expect(other.size());
    for (size_t b = 0; b < parts_->known.size(); ++b) {
        if (other.parts_->known[b].load() == 0) continue;
        const size_t first = b * kEntriesPerBlock, count = std::min<size_t>(kEntriesPerBlock, size() - first);
        std::copy_n(other.sparse_.data() + first, count, sparse_.data() + first);
        for (size_t page = first; page < first + count; ++page)
            for (const uint64_t child : childrenOf(sparse_[page])) parts_->afterParents[child] = uint32_t(page + 1);
        parts_->known[b] = 1;
    }
    parts_->blocksKnown = other.parts_->blocksKnown.load();
    return *this;
}

void PageDirectory::expect(size_t pages) {
    entries_ = {};
    sparse_ = SparseArray<PageEntry>(pages);
    parts_ = std::make_unique<Parts>(pages);
}

bool PageDirectory::knowsBlock(uint64_t block) const {
    return !parts_ || parts_->known[block].load(std::memory_order_acquire) != 0;
}
uint64_t PageDirectory::blocksKnown() const {
    return parts_ ? parts_->blocksKnown.load(std::memory_order_acquire) : blocks();
}

/// Takes one block in: checks its entries by themselves, then against the known parents and children. Each page has one
/// parent, on the level above: so what is known is a tree, whatever the rest will be.
class BlockAdmission {
public:
    BlockAdmission(const Dataset& dataset, const std::string& file, uint64_t block)
        : d_(dataset),
          directory_(dataset.pages),
          file_(file),
          block_(block),
          first_(block * kEntriesPerBlock),
          count_(std::min<uint64_t>(kEntriesPerBlock, dataset.header.pages - first_)) {}

    Result<void> run(std::span<const std::byte> bytes) {
        PageDirectory::Parts& parts = *directory_.parts_;
        const Turn turn(parts.admitting);
        if (directory_.knowsBlock(block_)) return {};
        std::memcpy(&directory_.sparse_[first_], bytes.data(), count_ * sizeof(PageEntry));
        if (auto sound = check(); !sound) {
            // What was refused must not be found here later.
            std::fill_n(&directory_.sparse_[first_], count_, PageEntry{});
            return sound;
        }
        parts.known[block_].store(1, std::memory_order_release);
        parts.blocksKnown.fetch_add(1, std::memory_order_release);
        return {};
    }

private:
    Result<void> check() const {
        EntryCheck entries(file_, d_);
        for (uint64_t page = first_; page < first_ + count_; ++page) {
            VCP_TRY(entries.check(page, directory_[page], levelOf(page)));
            VCP_TRY(linkChildren(page));
            VCP_TRY(checkParent(page));
        }
        return {};
    }
    [[nodiscard]] uint32_t levelOf(uint64_t page) const {
        uint32_t level = 0;
        while (page >= d_.header.level[level].firstEntry + d_.header.level[level].pages) ++level;
        return level;
    }
    [[nodiscard]] bool isThere(uint64_t page) const {
        return page / kEntriesPerBlock == block_ || directory_.knows(page);
    }

    Result<void> linkChildren(uint64_t page) const {
        const PageEntry& e = directory_[page];
        if (e.childMask == 0) return {};
        if (e.level + 1u >= d_.header.levels) return brokenEntry(file_, page, "wrong child pages");
        const LevelRow& below = d_.header.level[e.level + 1];
        if (e.firstChild < below.firstEntry || *childrenOf(e).end() > below.firstEntry + below.pages)
            return brokenEntry(file_, page, "wrong child pages");
        return eachChild(e, [&](uint64_t child, uint32_t octant) -> Result<void> {
            uint32_t& parent = directory_.parts_->afterParents[child];
            if (parent != PageDirectory::Parts::kNoPage && parent != page + 1)
                return brokenEntry(file_, page, "wrong child pages");
            parent = uint32_t(page + 1);
            if (isThere(child) && !isChildAt(directory_[child], e, octant))
                return brokenEntry(file_, page, "child pages do not match");
            return {};
        });
    }

    Result<void> checkParent(uint64_t page) const {
        const uint32_t after = directory_.parts_->afterParents[page];
        if (after == PageDirectory::Parts::kNoPage || !isThere(after - 1)) return {};
        const PageEntry& parent = directory_[after - 1];
        return eachChild(parent, [&](uint64_t child, uint32_t octant) -> Result<void> {
            if (child == page && !isChildAt(directory_[page], parent, octant))
                return brokenEntry(file_, page, "child pages do not match");
            return {};
        });
    }

    const Dataset& d_;
    const PageDirectory& directory_;
    const std::string& file_;
    uint64_t block_, first_, count_;
};

Result<void> admitBlock(const Dataset& dataset, const std::string& file, uint64_t block,
                        std::span<const std::byte> bytes) {
    if (dataset.pages.knowsBlock(block)) return {};
    VCP_TRY(checkBlock(file, block,
                       std::min<uint64_t>(kEntriesPerBlock, dataset.header.pages - block * kEntriesPerBlock), bytes));
    return BlockAdmission(dataset, file, block).run(bytes);
}

}  // namespace vcp
