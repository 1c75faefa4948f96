// Background threads that read pages. They give way to the threads that draw: where these keep the processor busy, as a
// software device does, a frame takes about as long with loads as without.
// A page's way: wished for in request(), read and checked by a thread, fetched with collect(). request() replaces
// all earlier wishes except those that a thread has begun; so what no view wants any more is not read. A page
// that fails is tried again after a while, and given up after a few attempts (request_queue.h); meanwhile the
// threads read other pages. Pages that lie together and are about as urgent are read together where the source
// says so. Each part of the source has so many threads and takes no more, so a part that is slow, or answers nothing at
// all, keeps no other waiting. Of parts that have one thread each, 16 at most are read at a time: to decode a hundred
// pages at once takes more memory than the pages have.
//
// No read begins while as many bytes are done as the next collect() would take: a moving view changes its wishes before
// more could be of use, and what was read would be wasted.
//
// Memory is reserved before a page is read and given back when it is collected: it never exceeds the limit. The source
// may keep stored pages in what is left of it (PageSource::keepWithin). Only waitForPage() and the destructor wait; the
// destructor interrupts reads in progress.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "streaming/page_source.h"
#include "streaming/request.h"
#include "streaming/request_queue.h"

namespace vcp {

/// What came of a request.
struct Loaded {
    Request request;
    Result<PageBytes> bytes;  ///< an error: it was given up
};

struct LoaderOptions {
    bool withColour = true;
    std::vector<uint32_t> threads = {2};  ///< by part of the source (PageSource::partOf), at least one each
    uint64_t heldBytes =
        64ull << 20;  ///< most bytes of pages being read or not collected yet, and of those that the source keeps
    RetryPolicy retry;
};

struct LoaderStats {
    uint64_t bytesRead = 0;     ///< decompressed bytes of all pages that were read without an error
    uint64_t pagesRead = 0;     ///< pages read without an error
    uint64_t failures = 0;      ///< single attempts that failed
    uint64_t heldBytes = 0;     ///< bytes of pages being read or not collected yet
    uint64_t heldBytesMax = 0;  ///< most bytes of these and of what the source kept, at any time
};

/// Reads pages in threads of its own. All functions but constructor and destructor may be called from any thread.
class PageLoader {
public:
    PageLoader(std::shared_ptr<const PageSource> source, const LoaderOptions& options);
    ~PageLoader();
    PageLoader(const PageLoader&) = delete;
    PageLoader& operator=(const PageLoader&) = delete;

    /// Replaces the list of wishes. Pages being read or waiting to be collected are not read again. While pages of
    /// `mostDone` bytes wait to be collected, no further read begins.
    void request(std::vector<Wish> wishes, uint64_t mostDone = UINT64_MAX);

    /// Pages that are done, in the order they were; as many as have `mostBytes` together, but one at least.
    /// Never waits for a read.
    std::vector<Loaded> collect(uint64_t mostBytes = UINT64_MAX);

    /// Waits until collect() would return something. Returns false after `timeout`, or where nothing is wished for or
    /// under way.
    bool waitForPage(std::chrono::milliseconds timeout);

    /// The number of wishes not begun, being read, or not collected.
    [[nodiscard]] size_t pending() const;
    [[nodiscard]] LoaderStats stats() const;

private:
    struct Run {
        Request first;
        uint32_t count = 0;
    };
    void work();
    [[nodiscard]] std::optional<Run> beginRun(double now);
    [[nodiscard]] std::vector<Result<PageBytes>> read(Run run) const;
    void finishRun(Run run, std::vector<Result<PageBytes>> pages);
    void shareMemory();
    void handOver(Request request, Result<PageBytes> bytes);
    [[nodiscard]] bool fits(uint64_t bytes) const { return bytes <= options_.heldBytes - stats_.heldBytes; }

    const std::shared_ptr<const PageSource> source_;
    const LoaderOptions options_;

    mutable std::mutex mutex_;
    std::condition_variable work_, ready_;
    RequestQueue queue_;
    std::vector<uint32_t> idle_;  // threads by part that read nothing
    std::vector<Loaded> done_;
    uint64_t doneBytes_ = 0, mostDone_ = UINT64_MAX;
    LoaderStats stats_;
    bool stop_ = false;
    uint32_t working_ = 0;  // threads that have not ended
    std::vector<std::thread> threads_;
};

}  // namespace vcp
