// Shows a person or a program the progress of a long task: on stderr, as a bar, plain lines or JSON lines.
//
// Used by one thread. finish() and the destructor erase the bar, so that an error line after it stands alone.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace vcp {

enum class ProgressStyle {
    Bar,    ///< one line that is redrawn; for terminals
    Plain,  ///< a line for every stage and every tenth of the way; for logs
    Json,   ///< one object a line: stage, fraction, seconds, seconds_left and, while building, triangles,
            ///< triangles_per_second, temp_bytes
    None,
};

/// Parses "bar", "plain", "json" or "none".
std::optional<ProgressStyle> progressStyleNamed(std::string_view name);

/// Returns a bar when stderr is a terminal, else no display.
ProgressStyle defaultProgressStyle();

/// What a build adds to its progress.
struct ProgressDetails {
    uint64_t triangles = 0;  ///< triangles read so far; 0: not shown
    uint64_t tempBytes = 0;
    double begun = 0;  ///< fraction that was done when this run began: time and speed are of what came after it
};

class ProgressDisplay {
public:
    /// `clock`: seconds since any moment; the system's where it is empty.
    ProgressDisplay(ProgressStyle style, std::FILE* out, std::function<double()> clock = {});
    ProgressDisplay(const ProgressDisplay&) = delete;
    ProgressDisplay& operator=(const ProgressDisplay&) = delete;
    ~ProgressDisplay() { finish(); }

    /// Shows `fraction` of the whole, 0 to 1. Cheap; writes only what is new.
    void update(std::string_view stage, double fraction, const ProgressDetails& details = {});

    void finish();

private:
    void drawBar(std::string_view stage, double fraction, const std::string& facts);
    [[nodiscard]] double seconds() const { return clock_() - start_; }

    ProgressStyle style_;
    std::FILE* out_;
    std::function<double()> clock_;
    double start_;
    std::string lastStage_;
    std::string lastBar_;
    int lastStep_ = -1;
    double lastSeconds_ = 0;
    int lastPerMille_ = -1;
};

}  // namespace vcp
