#include "viewer/command/terminal/progress_display.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include "viewer/command/terminal/terminal_text.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

int terminalColumns(std::FILE* out) {
    winsize size{};
    if (ioctl(fileno(out), TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
    return size.ws_col;
}

double steadySeconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Progress that stands still is shown again after so long, with its new counts.
constexpr double kJsonSeconds = 2, kPlainSeconds = 30, kBarSeconds = 0.5;

}  // namespace

std::optional<ProgressStyle> progressStyleNamed(std::string_view name) {
    if (name == "bar") return ProgressStyle::Bar;
    if (name == "plain") return ProgressStyle::Plain;
    if (name == "json") return ProgressStyle::Json;
    if (name == "none") return ProgressStyle::None;
    return std::nullopt;
}

ProgressStyle defaultProgressStyle() { return isatty(STDERR_FILENO) ? ProgressStyle::Bar : ProgressStyle::None; }

ProgressDisplay::ProgressDisplay(ProgressStyle style, std::FILE* out, std::function<double()> clock)
    : style_(style), out_(out), clock_(clock ? std::move(clock) : steadySeconds), start_(clock_()) {}

void ProgressDisplay::update(std::string_view stage, double fraction, const ProgressDetails& details) {
    if (style_ == ProgressStyle::None) return;
    fraction = std::clamp(fraction, 0.0, 1.0);
    const double elapsed = seconds();
    const std::optional<double> left = secondsLeft(elapsed, fraction, details.begun);
    std::string facts;
    if (details.triangles > 0) facts += fmt::format(", {} triangles", formatCount(details.triangles));
    if (details.tempBytes > 0) facts += fmt::format(", {} temporary", formatBytes(details.tempBytes));
    if (left) facts += fmt::format(", {} left", formatTimeLeft(*left));
    if (style_ == ProgressStyle::Bar) return drawBar(stage, fraction, facts);

    const int steps = style_ == ProgressStyle::Json ? 100 : 10;
    const int step = int(std::floor(fraction * steps));
    const bool isDue = elapsed - lastSeconds_ >= (style_ == ProgressStyle::Json ? kJsonSeconds : kPlainSeconds);
    if (stage == lastStage_ && step == lastStep_ && !isDue) return;
    lastSeconds_ = elapsed;
    lastStage_ = stage;
    lastStep_ = step;
    std::string line;
    if (style_ == ProgressStyle::Json) {
        nlohmann::ordered_json json = {{"stage", stage}, {"fraction", fraction}, {"seconds", elapsed}};
        if (left) json["seconds_left"] = *left;
        if (details.triangles > 0) {
            json["triangles"] = details.triangles;
            json["triangles_per_second"] =
                (fraction - details.begun) * double(details.triangles) / std::max(elapsed, 1e-9);
            json["temp_bytes"] = details.tempBytes;
        }
        line = terminalJson(json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
    } else {
        line = fmt::format("{:3.0f} % {} ({}{})", 100 * fraction, terminalText(stage), formatSeconds(elapsed), facts);
    }
    std::fprintf(out_, "%s\n", line.c_str());
    std::fflush(out_);
}

void ProgressDisplay::drawBar(std::string_view stage, double fraction, const std::string& facts) {
    const int perMille = int(1000 * fraction);
    const bool isDue = seconds() - lastSeconds_ >= kBarSeconds;
    if (stage == lastStage_ && perMille == lastPerMille_ && !isDue) return;
    lastSeconds_ = seconds();
    lastStage_ = stage;
    lastPerMille_ = perMille;
    const int columns = std::max(20, terminalColumns(out_) - 1);
    const std::string head = fmt::format("{:3.0f} % ", 100 * fraction);
    const std::string tail = fmt::format(" {}{}", terminalText(stage), facts);
    const int room = std::clamp(columns - int(head.size() + tail.size()) - 2, 0, 40);
    const int filled = int(std::lround(fraction * room));
    const std::string bar =
        head + "[" + std::string(size_t(filled), '=') + std::string(size_t(room - filled), ' ') + "]" + tail;
    lastBar_ = bar.substr(0, size_t(columns));
    // A character of several bytes is cut off as a whole.
    while (lastBar_.size() < bar.size() && (uint8_t(bar[lastBar_.size()]) & 0xc0) == 0x80) lastBar_.pop_back();
    std::fprintf(out_, "\r%s\x1b[K", lastBar_.c_str());
    std::fflush(out_);
}

void ProgressDisplay::finish() {
    if (lastBar_.empty()) return;
    std::fputs("\r\x1b[K", out_);
    std::fflush(out_);
    lastBar_.clear();
}

}  // namespace vcp
