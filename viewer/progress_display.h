// How a long task tells a person or a program how far it is: on stderr, as a bar, plain lines or JSON lines.
//
// One thread. The bar is erased by finish() and by the destructor, so that an error line after it stands alone.
#pragma once

#include <chrono>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>

namespace vcp {

enum class ProgressStyle {
    Bar,    ///< one line that is redrawn; for terminals
    Plain,  ///< a line for every stage and every tenth of the way; for logs
    Json,   ///< one object a line: {"stage": ..., "fraction": ..., "seconds": ...}
    None,
};

/// "bar", "plain", "json", "none".
std::optional<ProgressStyle> progressStyleNamed(std::string_view name);

/// A bar when stderr is a terminal, else nothing.
ProgressStyle defaultProgressStyle();

class ProgressDisplay {
public:
    ProgressDisplay(ProgressStyle style, std::FILE* out) : style_(style), out_(out) {}
    ProgressDisplay(const ProgressDisplay&) = delete;
    ProgressDisplay& operator=(const ProgressDisplay&) = delete;
    ~ProgressDisplay() { finish(); }

    /// `fraction` of the whole, 0 to 1. Cheap; writes only what is new.
    void update(std::string_view stage, double fraction);

    void finish();

private:
    void drawBar(std::string_view stage, double fraction);

    ProgressStyle style_;
    std::FILE* out_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    std::string lastStage_;
    std::string lastBar_;
    int lastStep_ = -1;
    int lastPerMille_ = -1;
};

}  // namespace vcp
