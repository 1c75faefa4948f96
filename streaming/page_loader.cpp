#include "streaming/page_loader.h"

#include <sys/resource.h>
#include <unistd.h>
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "octree/io/caught.h"
#include "streaming/steady_seconds.h"

namespace vcp {

namespace {

constexpr uint32_t kLongestRun = 64;
constexpr uint32_t kMostSingleThreads = 16;  // of parts that have one thread each
/// Pages are read together with a more urgent one where their urgency is at least this share of its own.
constexpr double kRunUrgency = 0.5;

uint64_t sizeOf(const Loaded& loaded) { return loaded.bytes ? loaded.bytes->bytes() : 0; }

/// As messages name it.
std::string elementOf(Request request) {
    const char* const names[] = {"page", "directory block", "piece of images"};
    return fmt::format("{} {}", names[size_t(request.kind)], request.number);
}

// Makes this thread, one of `threads`, less urgent than what started it, by steps of the system's niceness. Each step
// takes a fifth of its share of the processor. All together have about the share that two threads have 8 steps down, a
// third of one thread that draws.
void giveWay(uint32_t threads) {
    const int steps = 8 + int(std::lround(std::log(std::max(threads, 2u) / 2.0) / std::log(1.25)));
    const auto thread = static_cast<id_t>(::gettid());
    ::setpriority(PRIO_PROCESS, thread, ::getpriority(PRIO_PROCESS, thread) + steps);
}

}  // namespace

PageLoader::PageLoader(std::shared_ptr<const PageSource> source, const LoaderOptions& options)
    : source_(std::move(source)), options_(options), queue_(options.retry), idle_(options.threads) {
    uint32_t single = 0;
    for (uint32_t& threads : idle_) {
        threads = std::max(threads, 1u);
        (threads == 1 ? single : working_) += threads;
    }
    working_ += std::min(single, kMostSingleThreads);
    shareMemory();
    const uint32_t threads = working_;
    while (threads_.size() < threads)
        threads_.emplace_back([this, threads] {
            giveWay(threads);
            work();
        });
}

PageLoader::~PageLoader() {
    {
        std::unique_lock lock(mutex_);
        stop_ = true;
        work_.notify_all();
        ready_.notify_all();
        // A thread may just be about to read, so it is interrupted until it has ended.
        while (working_ > 0) {
            lock.unlock();
            source_->interrupt();
            lock.lock();
            ready_.wait_for(lock, std::chrono::milliseconds(10), [&] { return working_ == 0; });
        }
    }
    for (std::thread& thread : threads_) thread.join();
}

void PageLoader::request(std::vector<Wish> wishes, uint64_t mostDone) {
    {
        const std::lock_guard lock(mutex_);
        mostDone_ = mostDone;
        queue_.replace(std::move(wishes));
    }
    work_.notify_all();
    ready_.notify_all();
}

std::vector<Loaded> PageLoader::collect(uint64_t mostBytes) {
    std::vector<Loaded> pages;
    {
        const std::lock_guard lock(mutex_);
        uint64_t bytes = 0;
        auto end = done_.begin();
        while (end != done_.end() && (end == done_.begin() || bytes + sizeOf(*end) <= mostBytes))
            bytes += sizeOf(*end++);
        pages.assign(std::make_move_iterator(done_.begin()), std::make_move_iterator(end));
        done_.erase(done_.begin(), end);
        for (const Loaded& page : pages) queue_.delivered(page.request);
        stats_.heldBytes -= bytes;
        doneBytes_ -= bytes;
    }
    work_.notify_all();
    return pages;
}

bool PageLoader::waitForPage(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    ready_.wait_for(lock, timeout, [&] { return !done_.empty() || queue_.pending() == 0 || stop_; });
    return !done_.empty();
}

size_t PageLoader::pending() const {
    const std::lock_guard lock(mutex_);
    return queue_.pending();
}

LoaderStats PageLoader::stats() const {
    const std::lock_guard lock(mutex_);
    return stats_;
}

/// Reserves memory for the most urgent page and those read with it; returns nothing where none may begin now. A run of
/// no pages means that one was handed over unread.
std::optional<PageLoader::Run> PageLoader::beginRun(double now) {
    if (doneBytes_ >= mostDone_) return std::nullopt;
    const auto wish = queue_.next(now, [&](Request request) { return idle_[source_->partOf(request)] > 0; });
    if (!wish) return std::nullopt;
    const Request first = wish->request;
    const uint64_t bytes = source_->bytesToRead(first, options_.withColour);
    if (bytes > options_.heldBytes) {
        const PageOrigin origin = source_->originOf(first);
        queue_.begin(first);
        handOver(first,
                 Error{.code = ErrorCode::Limit,
                       .message = fmt::format("reading it takes {} bytes of memory, more than the {} bytes allowed for "
                                              "pages on their way; allow more, or build the file with smaller cells",
                                              bytes, options_.heldBytes),
                       .file = origin.file,
                       .element = elementOf(origin.request)});
        return Run{first, 0};
    }
    if (!fits(bytes)) return std::nullopt;
    Run run{first, 0};
    const uint32_t most = source_->runFrom(first, kLongestRun, options_.withColour);
    do {
        const Request page = first.after(run.count);
        const uint64_t more = source_->bytesToRead(page, options_.withColour);
        if (run.count > 0 && (!queue_.mayBegin(page, wish->priority * kRunUrgency, now) || !fits(more))) break;
        queue_.begin(page);
        stats_.heldBytes += more;
    } while (++run.count < most);
    --idle_[source_->partOf(first)];
    shareMemory();
    return run;
}

/// Lets the source keep stored pages in the memory that pages on their way leave free.
void PageLoader::shareMemory() {
    const uint64_t kept = source_->keepWithin(options_.heldBytes - stats_.heldBytes);
    stats_.heldBytesMax = std::max(stats_.heldBytesMax, stats_.heldBytes + kept);
}

void PageLoader::handOver(Request request, Result<PageBytes> bytes) {
    done_.push_back({request, std::move(bytes)});
    stats_.heldBytes += sizeOf(done_.back());
    doneBytes_ += sizeOf(done_.back());
    ready_.notify_all();
}

void PageLoader::finishRun(Run run, std::vector<Result<PageBytes>> pages) {
    if (run.count > 0) ++idle_[source_->partOf(run.first)];
    for (uint32_t i = 0; i < run.count; ++i) {
        const Request page = run.first.after(i);
        stats_.heldBytes -= source_->bytesToRead(page, options_.withColour);
        if (pages[i]) {
            handOver(page, std::move(pages[i]));
            stats_.bytesRead += sizeOf(done_.back());
            ++stats_.pagesRead;
        } else if (pages[i].error().code == ErrorCode::Cancelled) {
            queue_.returned(page);
        } else {
            ++stats_.failures;
            if (queue_.failed(page, pages[i].error().code, steadySeconds())) handOver(page, std::move(pages[i]));
        }
    }
    shareMemory();
}

/// Reads a run; an exception fails each of its pages.
std::vector<Result<PageBytes>> PageLoader::read(Run run) const {
    using Pages = std::vector<Result<PageBytes>>;
    auto pages = caught([&]() -> Result<Pages> { return source_->readRun(run.first, run.count, options_.withColour); },
                        source_->originOf(run.first).file);
    if (pages) return *std::move(pages);
    Pages failed;
    for (uint32_t i = 0; i < run.count; ++i) {
        Error error = pages.error();
        error.element = elementOf(source_->originOf(run.first.after(i)).request);
        failed.emplace_back(std::move(error));
    }
    return failed;
}

void PageLoader::work() {
    std::unique_lock lock(mutex_);
    while (!stop_) {
        const double now = steadySeconds();
        if (const auto run = beginRun(now)) {
            lock.unlock();
            auto pages = read(*run);
            lock.lock();
            finishRun(*run, std::move(pages));
            work_.notify_all();  // memory was given back, and a part has a thread more
        } else {
            // New wishes, collect(), or a page that may be tried again wake it.
            const double wait = queue_.nextTry(now) - now;
            if (wait > 0 && std::isfinite(wait))
                work_.wait_for(lock, std::chrono::duration<double>(wait));
            else
                work_.wait(lock);
        }
    }
    --working_;
    ready_.notify_all();
}

}  // namespace vcp
