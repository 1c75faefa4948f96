#include "viewer/command/terminal/interrupt.h"

#include <atomic>

namespace vcp {

namespace {

// This is global, since a signal handler can reach nothing else.
std::atomic<bool> came{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void onInterrupt(int) { came.store(true); }

}  // namespace

InterruptScope::InterruptScope() {
    struct sigaction action {};
    action.sa_handler = onInterrupt;
    action.sa_flags = int(SA_RESETHAND);
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, &interrupt_);
    sigaction(SIGTERM, &action, &terminate_);
    sigaction(SIGHUP, nullptr, &hangUp_);
    if (hangUp_.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
}

InterruptScope::~InterruptScope() {
    sigaction(SIGINT, &interrupt_, nullptr);
    sigaction(SIGTERM, &terminate_, nullptr);
    sigaction(SIGHUP, &hangUp_, nullptr);
}

bool interrupted() { return came.load(); }

}  // namespace vcp
