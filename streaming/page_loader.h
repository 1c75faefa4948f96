// Background threads that read pages.
//
// A page's way: wished for in request(), read and checked by a thread, fetched with collect(). request()
// replaces all wishes before it, but those that a thread has begun with; so what no view wants any more is
// not read. Nothing here waits but waitForPage() and the destructor, which lets reads in progress end.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <unordered_set>
#include <vector>

#include "streaming/page_source.h"

namespace vcp {

struct PageRequest {
    uint64_t page;
    double priority;  ///< larger first; of equals the order of the list

    bool operator==(const PageRequest&) const = default;
};

struct LoadedPage {
    uint64_t page;
    Result<PageBytes> bytes;
};

/// All functions but the constructor and destructor may be called from any thread.
class PageLoader {
public:
    /// `heldBytes`: pages that are read but not collected yet take at most this much (and one page a thread
    /// more); then the threads rest.
    PageLoader(std::shared_ptr<const PageSource> source, bool withColour, uint32_t threads, uint64_t heldBytes);
    ~PageLoader();
    PageLoader(const PageLoader&) = delete;
    PageLoader& operator=(const PageLoader&) = delete;

    /// Replaces the list of wishes. Pages being read or waiting to be collected are not read again.
    void request(std::vector<PageRequest> wishes);

    /// Pages that are done, in the order they were; at most `most`. Never waits for a read.
    std::vector<LoadedPage> collect(size_t most = SIZE_MAX);

    /// Waits until collect() would give something. False: after `timeout`, or nothing is wished for or under
    /// way.
    bool waitForPage(std::chrono::milliseconds timeout);

    /// Wishes not begun, being read, or not collected.
    [[nodiscard]] size_t pending() const;
    /// Decompressed bytes of all pages that were read without an error.
    [[nodiscard]] uint64_t bytesRead() const;

private:
    void run();
    [[nodiscard]] bool mayBegin() const { return !wishes_.empty() && doneBytes_ < heldBytes_; }

    const std::shared_ptr<const PageSource> source_;
    const bool withColour_;
    const uint64_t heldBytes_;

    mutable std::mutex mutex_;
    std::condition_variable work_, ready_;
    std::vector<PageRequest> wishes_;  // the most urgent last
    std::unordered_set<uint64_t> begun_;  // being read or in done_
    std::vector<LoadedPage> done_;
    uint64_t doneBytes_ = 0, bytesRead_ = 0;
    bool stop_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace vcp
