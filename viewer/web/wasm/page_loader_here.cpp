// The loader of pages where there are no threads (streaming/page_loader.h): collect() reads, in the calling thread,
// what the browser has fetched. A page whose bytes have not come is Cancelled by its source and stays wished for.
#include <limits>

#include "streaming/page_loader.h"

namespace vcp {

namespace {

uint64_t sizeOf(const Loaded& loaded) { return loaded.bytes ? loaded.bytes->bytes() : 0; }

}  // namespace

PageLoader::PageLoader(std::shared_ptr<const PageSource> source, const LoaderOptions& options)
    : source_(std::move(source)), options_(options), queue_(options.retry) {}

PageLoader::~PageLoader() = default;

void PageLoader::request(std::vector<Wish> wishes, uint64_t mostDone) {
    mostDone_ = mostDone;
    queue_.replace(std::move(wishes));
}

std::vector<Loaded> PageLoader::collect(uint64_t mostBytes) {
    // The browser, and not the clock, says when a page is tried again.
    constexpr double kAnyTime = std::numeric_limits<double>::max();
    std::vector<Loaded> pages;
    std::vector<Request> waiting;
    uint64_t bytes = 0;
    while (bytes < mostBytes) {
        const auto wish = queue_.next(kAnyTime);
        if (!wish) break;
        queue_.begin(wish->request);
        auto read = source_->read(wish->request, options_.withColour);
        if (!read && read.error().code == ErrorCode::Cancelled) {
            waiting.push_back(wish->request);
            continue;
        }
        if (!read) {
            ++stats_.failures;
            if (!queue_.failed(wish->request, read.error().code, 0)) continue;
        }
        pages.push_back({wish->request, std::move(read)});
        queue_.delivered(wish->request);
        bytes += sizeOf(pages.back());
        stats_.bytesRead += sizeOf(pages.back());
        stats_.pagesRead += pages.back().bytes ? 1 : 0;
    }
    for (const Request request : waiting) queue_.returned(request);
    stats_.heldBytesMax = std::max(stats_.heldBytesMax, bytes);
    return pages;
}

bool PageLoader::waitForPage(std::chrono::milliseconds) { return false; }

size_t PageLoader::pending() const { return queue_.pending(); }

LoaderStats PageLoader::stats() const { return stats_; }

}  // namespace vcp
