// Handles Ctrl-C during a long task, or the terminal's end: the first one asks the task to stop and clean up, the
// second one ends the process.
#pragma once

#include <csignal>

namespace vcp {

/// Takes over SIGINT, SIGTERM and, unless it is ignored as by nohup, SIGHUP while it lives, then restores them. One at
/// a time.
class InterruptScope {
public:
    InterruptScope();
    ~InterruptScope();
    InterruptScope(const InterruptScope&) = delete;
    InterruptScope& operator=(const InterruptScope&) = delete;

private:
    struct sigaction interrupt_ {};
    struct sigaction terminate_ {};
    struct sigaction hangUp_ {};
};

/// Returns true once a signal came within a scope. Any thread.
bool interrupted();

}  // namespace vcp
