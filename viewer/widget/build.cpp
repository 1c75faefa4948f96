#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "builder/build.h"
#include "viewer/widget/handles.h"

namespace vcp::widget {

namespace {

constexpr std::chrono::milliseconds kProgressEvery{100};

/// Runs a build in a thread of its own, so that the host hears of it in the thread that called.
class BuildRun {
public:
    explicit BuildRun(BuildOptions options) : options_(std::move(options)) {
        options_.progress = [this](const BuildProgress& at) { return hear(at); };
    }

    /// Reports until the build is done. `tell` returns false to cancel, and is not called again then, nor after this
    /// has returned.
    template <class Tell>
    Result<BuildReport> run(Tell tell) {
        std::jthread thread([this] {
            Outcome thrown = outcomeOf([&] {
                report_ = buildOctree(options_);
                return Outcome();
            });
            const std::lock_guard lock(mutex_);
            if (thrown.status != VCP_OK) report_ = Error{.code = ErrorCode::Limit, .message = thrown.text};
            done_ = true;
            news_.notify_one();
        });
        std::vector<BuildProgress> untold;
        for (bool isOver = false, goesOn = true; !isOver;) {
            {
                std::unique_lock lock(mutex_);
                cancelled_ = !goesOn;
                news_.wait_for(lock, kProgressEvery, [this] { return done_ || !heard_.empty(); });
                isOver = done_;
                // Where nothing is new, the last report is repeated, so that a host may cancel in a long stage.
                if (isOver || !heard_.empty()) untold = std::exchange(heard_, {});
            }
            for (const BuildProgress& at : untold) goesOn = goesOn && tell(at);
            if (!untold.empty()) untold.erase(untold.begin(), std::prev(untold.end()));
        }
        thread.join();
        return *std::move(report_);
    }

private:
    bool hear(const BuildProgress& at) {
        const std::lock_guard lock(mutex_);
        // A host that is slow misses steps of a stage, but never a stage.
        if (heard_.empty() || heard_.back().stage != at.stage)
            heard_.push_back(at);
        else
            heard_.back() = at;
        news_.notify_one();
        return !cancelled_;
    }

    BuildOptions options_;
    std::mutex mutex_;
    std::condition_variable news_;
    std::vector<BuildProgress> heard_;  // guarded by mutex_, like the next two
    bool cancelled_ = false, done_ = false;
    std::optional<Result<BuildReport>> report_;  // belongs to the thread until done_
};

Result<BuildOptions> buildOptions(const vcp_build_options& given) {
    BuildOptions options;
    if (given.input_count == 0 || !given.inputs) return wrong("there is nothing to build from");
    for (uint32_t i = 0; i < given.input_count; ++i) {
        // Standard input belongs to the program, so the library must not read it.
        const std::string input = textOf(given.inputs[i]);
        if (input.empty() || input == "-") return wrong("an input has no path");
        options.inputs.emplace_back(input);
    }
    if (!given.output || *given.output == '\0') return wrong("there is no path to write to");
    if (!(given.cell >= 0) || !(given.error >= 0)) return wrong("cell or error is below 0 or not a number");
    options.output = given.output;
    options.temp = textOf(given.temp_folder);
    options.cell = given.cell;
    options.error = given.error;
    options.memoryBytes = given.memory_bytes;
    options.threads = given.threads;
    options.resume = given.resume != 0;
    options.format = textOf(given.format);
    if (given.colour < VCP_COLOUR_AUTO || given.colour > VCP_COLOUR_NONE) return wrong("there is no such colour");
    options.colour = static_cast<ColourChoice>(given.colour);
    return options;
}

/// Tells the host; returns false where it cancels. An exception of its callback ends the build as well.
bool tellHost(const vcp_build_options& given, const BuildProgress& at) {
    if (!given.progress) return true;
    const vcp_progress progress{sizeof(vcp_progress), at.stage.c_str(), at.fraction, at.triangles, at.seconds};
    bool goesOn = false;
    const Outcome outcome = outcomeOf([&] {
        goesOn = given.progress(given.user, &progress) != 0;
        return Outcome();
    });
    return goesOn && outcome.status == VCP_OK;
}

Result<void> buildFor(const vcp_build_options& given, vcp_build_report* out) {
    VCP_TRY_ASSIGN(auto options, buildOptions(given));
    if (out)
        if (const auto size = structSize(out); !size) return size.error();
    VCP_TRY_ASSIGN(const auto report,
                   BuildRun(std::move(options)).run([&](const BuildProgress& at) { return tellHost(given, at); }));
    if (!out) return {};
    vcp_build_report made{};
    made.levels = report.levels;
    made.triangles = report.triangles;
    made.file_bytes = report.fileBytes;
    made.cell = report.cell;
    made.certified_error = report.certifiedErrorMax;
    made.seconds = report.seconds;
    return give(out, made);
}

}  // namespace

static_assert(VCP_COLOUR_TEXTURE == int(ColourChoice::Texture) && VCP_COLOUR_NONE == int(ColourChoice::None));

}  // namespace vcp::widget

using namespace vcp::widget;

extern "C" vcp_status vcp_build(const vcp_build_options* given, vcp_build_report* report) {
    vcp_build_options options{};
    const Outcome outcome = outcomeOf([&]() -> Outcome {
        VCP_TRY_ASSIGN(options, taken(given));
        return buildFor(options, report);
    });
    copyText(options.error_text, options.error_text_size, outcome.text);
    return outcome.status;
}
