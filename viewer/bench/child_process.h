// Runs work in a child process, so that its peak of memory and its time are its own: what a benchmark measures.
//
// The child is a fork that continues in this program. It reports its progress and its result through a pipe; a second
// pipe, whose other end the parent holds, tells it to stop, even when the parent is gone.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "octree/io/result.h"

namespace vcp {

/// Receives what is being done and the fraction of it; returns false to ask to stop.
using ChildProgress = std::function<bool(const std::string& what, double fraction)>;

/// Runs in the child. It may start threads. What it returns reaches the parent unchanged.
using ChildWork = std::function<Result<std::string>(const ChildProgress&)>;

struct ChildOutcome {
    std::string value;
    double cpuSeconds = 0;      ///< user and system, all threads
    uint64_t peakRssBytes = 0;  ///< the child's peak; begins with the parent's few megabytes
};

/// Runs `work` in a child and waits. `progress` (may be empty) is called here, at least ten times a second.
/// No other thread of this process may run meanwhile. Errors: what `work` returns; Limit (the child was killed,
/// mostly for memory); Io (no child can be made).
Result<ChildOutcome> runInChild(const ChildWork& work, const ChildProgress& progress = {});

/// Runs a program and waits; its stdout is discarded. `progress` as above; returning false ends the program with
/// SIGTERM. Errors: Io (it cannot be started, or did not end with status 0: its first line on stderr is the message);
/// Cancelled.
Result<void> runProgram(const std::vector<std::string>& arguments, const std::function<bool()>& progress = {});

}  // namespace vcp
