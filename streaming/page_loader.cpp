#include "streaming/page_loader.h"

#include <algorithm>

namespace vcp {

namespace {

uint64_t sizeOf(const LoadedPage& page) {
    return page.bytes ? page.bytes->geometryBytes().size() + page.bytes->colourBytes().size() : 0;
}

}  // namespace

PageLoader::PageLoader(std::shared_ptr<const PageSource> source, bool withColour, uint32_t threads, uint64_t heldBytes)
    : source_(std::move(source)), withColour_(withColour), heldBytes_(std::max<uint64_t>(heldBytes, 1)) {
    for (uint32_t i = 0; i < std::max(threads, 1u); ++i) threads_.emplace_back([this] { run(); });
}

PageLoader::~PageLoader() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    work_.notify_all();
    ready_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

void PageLoader::request(std::vector<PageRequest> wishes) {
    std::stable_sort(wishes.begin(), wishes.end(),
                     [](const PageRequest& a, const PageRequest& b) { return a.priority > b.priority; });
    std::reverse(wishes.begin(), wishes.end());
    {
        const std::lock_guard lock(mutex_);
        std::erase_if(wishes, [&](const PageRequest& wish) { return begun_.contains(wish.page); });
        wishes_ = std::move(wishes);
    }
    work_.notify_all();
    ready_.notify_all();
}

std::vector<LoadedPage> PageLoader::collect(size_t most) {
    std::vector<LoadedPage> pages;
    {
        const std::lock_guard lock(mutex_);
        const auto end = done_.begin() + static_cast<std::ptrdiff_t>(std::min(most, done_.size()));
        pages.assign(std::make_move_iterator(done_.begin()), std::make_move_iterator(end));
        done_.erase(done_.begin(), end);
        for (const LoadedPage& page : pages) {
            begun_.erase(page.page);
            doneBytes_ -= sizeOf(page);
        }
    }
    work_.notify_all();
    return pages;
}

bool PageLoader::waitForPage(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    ready_.wait_for(lock, timeout, [&] { return !done_.empty() || (wishes_.empty() && begun_.empty()) || stop_; });
    return !done_.empty();
}

size_t PageLoader::pending() const {
    const std::lock_guard lock(mutex_);
    return wishes_.size() + begun_.size();
}

uint64_t PageLoader::bytesRead() const {
    const std::lock_guard lock(mutex_);
    return bytesRead_;
}

void PageLoader::run() {
    std::unique_lock lock(mutex_);
    while (true) {
        work_.wait(lock, [&] { return stop_ || mayBegin(); });
        if (stop_) return;
        const uint64_t page = wishes_.back().page;
        wishes_.pop_back();
        if (!begun_.insert(page).second) continue;  // wished for twice
        lock.unlock();
        LoadedPage loaded{page, source_->read(page, withColour_)};
        lock.lock();
        doneBytes_ += sizeOf(loaded);
        bytesRead_ += sizeOf(loaded);
        done_.push_back(std::move(loaded));
        ready_.notify_all();
    }
}

}  // namespace vcp
