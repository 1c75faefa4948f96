#include "viewer/bench/stress/stress.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <set>

#include <fmt/format.h>

#include "viewer/bench/stress/stress_path.h"
#include "viewer/camera/camera_path.h"

namespace vcp {

namespace {

using Clock = std::chrono::steady_clock;

// A view to which nothing new has come for so long does not settle any more.
constexpr double kHopelessSeconds = 60;
// The number of pictures drawn for an order of arrival.
constexpr int kOrderDraws = 100;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Counts what is read of a file.
class CountingReader final : public ByteReader {
public:
    explicit CountingReader(std::shared_ptr<const ByteReader> reader) : reader_(std::move(reader)) {}
    Result<void> read(uint64_t offset, std::span<std::byte> to) const override {
        ++requests;
        bytes += to.size();
        return reader_->read(offset, to);
    }
    [[nodiscard]] uint64_t size() const override { return reader_->size(); }
    [[nodiscard]] const std::string& name() const override { return reader_->name(); }
    void interrupt() const override { reader_->interrupt(); }
    void distrust(uint64_t offset, uint64_t count) const override { reader_->distrust(offset, count); }

    mutable std::atomic<uint64_t> requests{0}, bytes{0};

private:
    std::shared_ptr<const ByteReader> reader_;
};

/// The conditions that must hold after each update; one that does not is noted once.
class Invariants {
public:
    Invariants(uint64_t budgetBytes, uint64_t ramBytes, std::vector<std::string>& violations)
        : budgetBytes_(budgetBytes), ramBytes_(ramBytes), violations_(violations) {}

    void check(const UpdateResult& update) {
        require(update.residentBytes <= budgetBytes_, "more bytes are resident than the budget allows");
        require(update.heldBytesMax <= ramBytes_, "pages on their way and kept take more memory than --ram allows");
        require(!update.settled || (update.pagesMissing == 0 && !update.awaitsRays), "settled is not what it says");
        require(update.reloads == 0, "a page was loaded twice in a still view");
        for (const Error& problem : update.problems) {
            require(reported_.insert(problem.line()).second, "a page that cannot be read was reported twice");
            ++pagesGivenUp;
        }
    }
    void check(const FrameStats& stats) {
        require(stats.poolBytes <= budgetBytes_, "the pool is larger than the budget");
    }
    void require(bool holds, const std::string& otherwise) {
        if (!holds && noted_.insert(otherwise).second) violations_.push_back(otherwise);
    }

    uint64_t pagesGivenUp = 0;

private:
    uint64_t budgetBytes_, ramBytes_;
    std::vector<std::string>& violations_;
    std::set<std::string> reported_, noted_;
};

class StressRun {
public:
    StressRun(const OpenDataset& open, const StressOptions& options)
        : open_(open),
          o_(options),
          invariants_(options.renderer.budgetBytes, options.renderer.ramBytes, report_.violations) {}

    Result<StressReport> run() {
        start_ = Clock::now();
        counted_ = std::make_shared<CountingReader>(open_.reader);
        VCP_TRY(openRenderer(renderer_, std::make_shared<FaultyReader>(counted_, o_.faults)));
        describe();
        VCP_TRY(firstView());
        VCP_TRY(choosePath());
        VCP_TRY(alongPath());
        VCP_TRY(withoutLoads());
        VCP_TRY(compareWithFaultless());
        VCP_TRY(compareOrdersOfArrival());
        VCP_TRY(severalViews());
        return std::move(report_);
    }

private:
    Result<void> openRenderer(std::unique_ptr<Renderer>& renderer, std::shared_ptr<const ByteReader> reader) const {
        VCP_TRY_ASSIGN(renderer, Renderer::create(o_.renderer));
        return renderer->open(open_.dataset,
                              std::make_shared<FilePageSource>(std::move(reader), open_.dataset, open_.runBytes()));
    }

    void describe() {
        report_.name = o_.name;
        report_.path = o_.path;
        report_.device = renderer_->device().name;
        report_.seed = o_.seed;
        report_.frames = o_.frames;
        report_.budgetBytes = o_.renderer.budgetBytes;
        report_.ramBytes = o_.renderer.ramBytes;
    }

    [[nodiscard]] FrameRequest requestFor(const Camera& camera) const {
        FrameRequest request;
        request.camera = camera;
        request.width = uint32_t(o_.size.x);
        request.height = uint32_t(o_.size.y);
        request.errorPixels = o_.errorPixels;
        return request;
    }

    /// Runs one round, and sets `frameMs` to the milliseconds that it took.
    Result<UpdateResult> frame(const FrameRequest& request, double& frameMs) {
        const auto began = Clock::now();
        auto update = renderer_->update(request);
        if (!update) return update;
        VCP_TRY_ASSIGN(auto stats, renderer_->render(request));
        frameMs = 1e3 * secondsSince(began);
        note(*update);
        invariants_.check(stats);
        return update;
    }

    void note(const UpdateResult& update) {
        invariants_.check(update);
        report_.residentBytesMax = std::max(report_.residentBytesMax, update.residentBytes);
        report_.heldBytesMax = update.heldBytesMax;
        report_.failures = update.failures;
        report_.loads = update.loads;
        report_.evictions = update.evictions;
        report_.relaxed = report_.relaxed || update.relaxed;
        report_.pagesGivenUp = invariants_.pagesGivenUp;
    }

    Result<void> ask(const std::string& what, double fraction) const {
        if (o_.progress && !o_.progress(what, fraction)) return Error::cancelled();
        return {};
    }

    /// Updates until the view has settled; `each` is called with every update.
    Result<UpdateResult> settle(const FrameRequest& request,
                                const std::function<void(const UpdateResult&)>& each = {}) {
        auto changedAt = Clock::now();
        uint64_t seen = 0;
        for (;;) {
            auto update = renderer_->update(request);
            if (!update) return update;
            note(*update);
            if (each) each(*update);
            if (update->settled) return update;
            if (update->bytesRead + update->failures != seen) changedAt = Clock::now();
            seen = update->bytesRead + update->failures;
            invariants_.require(secondsSince(changedAt) < kHopelessSeconds, "a view does not settle");
            if (!report_.violations.empty() && secondsSince(changedAt) >= kHopelessSeconds) return update;
            VCP_TRY(ask("settling", 0));
            if (update->awaitsRays)
                VCP_TRY(renderer_->render(request));
            else
                renderer_->waitForPage(std::chrono::milliseconds(20));
        }
    }

    /// Draws as soon as there is something to draw, then refines.
    Result<void> firstView() {
        const Camera whole = fitCamera(open_.bounds().low, open_.bounds().high, {0, -0.35, -1}, {0, 1, 0}, 0.6,
                                       double(o_.size.x) / o_.size.y);
        const FrameRequest request = requestFor(whole);
        VCP_TRY(settle(request, [&](const UpdateResult& update) {
            const auto now = [&] { return o_.openSeconds + secondsSince(start_); };
            if (update.drawable && report_.firstPictureSeconds == 0 && renderer_->render(request))
                report_.firstPictureSeconds = now();
            if (update.drawable && report_.detail90Seconds == 0 && update.pagesMissing * 10 <= update.pagesWanted)
                report_.detail90Seconds = now();
        }));
        VCP_TRY(renderer_->render(request));
        report_.settledSeconds = o_.openSeconds + secondsSince(start_);
        const auto hit = renderer_->pick(request.width / 2, request.height / 2);
        target_ = hit && *hit ? (*hit)->position : open_.bounds().centre();
        return {};
    }

    Result<void> choosePath() {
        StressPathOptions path{o_.path, open_.bounds(), target_, open_.dataset->header.cell,
                               o_.size, o_.frames,      o_.seed};
        if (auto known = stressPath(path)) {
            cameras_ = *std::move(known);
            return {};
        }
        const auto keys = readCameras(o_.path);
        if (!keys && keys.error().code == ErrorCode::Io)
            return Error{.code = ErrorCode::Io,
                         .message = "is neither a path's name nor a file that can be read",
                         .file = o_.path};
        if (!keys) return keys.error();
        for (const OrbitCamera& camera : cameraPath(*keys, o_.frames)) cameras_.push_back(camera.current());
        return {};
    }

    Result<void> alongPath() {
        std::vector<float> times;
        uint64_t loads = report_.loads, evictions = report_.evictions;
        for (size_t i = 0; i < cameras_.size(); ++i) {
            VCP_TRY(ask("flying", double(i) / double(cameras_.size())));
            StressSample sample;
            VCP_TRY_ASSIGN(const auto update, frame(requestFor(cameras_[i]), sample.frameMs));
            sample.seconds = secondsSince(start_);
            sample.errorPixels = update.errorPixels;
            sample.residentBytes = update.residentBytes;
            sample.pending = update.pagesPending;
            sample.loads = update.loads - loads;
            sample.evictions = update.evictions - evictions;
            sample.missing = update.pagesWanted > 0 ? double(update.pagesMissing) / update.pagesWanted : 0;
            loads = update.loads, evictions = update.evictions;
            times.push_back(float(sample.frameMs));
            report_.samples.push_back(sample);
        }
        report_.frameMs = quantilesOf(std::move(times));
        const auto began = Clock::now();
        VCP_TRY_ASSIGN(const auto settled, settle(requestFor(cameras_.back())));
        report_.pathSettledSeconds = secondsSince(began);
        report_.errorPixels = settled.errorPixels;
        VCP_TRY(renderer_->render(requestFor(cameras_.back())));
        VCP_TRY_ASSIGN(picture_, renderer_->readPicture());
        return {};
    }

    /// Draws the same frames, each with all pages that it wants, and notes what is drawn and what is above it.
    Result<void> withoutLoads() {
        const bool colour = o_.renderer.colour && open_.dataset->hasColour();
        std::set<uint64_t> needed;
        std::vector<float> times;
        for (size_t i = 0; i < cameras_.size(); ++i) {
            VCP_TRY(ask("flying without loads", double(i) / double(cameras_.size())));
            const FrameRequest request = requestFor(cameras_[i]);
            if (const auto settled = settle(request); !settled) return settled.error();
            double ms = 0;
            if (const auto update = frame(request, ms); !update) return update.error();
            times.push_back(float(ms));
            for (const PageBox& page : renderer_->residentPages())
                if (page.isDrawn) needed.insert(page.number);
        }
        report_.frameMsNoLoads = quantilesOf(std::move(times));
        report_.bytesRead = counted_->bytes;
        report_.requests = counted_->requests;
        // Children come later in the directory than their parents.
        const PageDirectory& pages = open_.dataset->pages;
        for (uint64_t page = pages.size(); page-- > 0;) {
            const EntryRange children = childrenOf(pages[page]);
            if (std::any_of(children.begin(), children.end(), [&](uint64_t child) { return needed.contains(child); }))
                needed.insert(page);
        }
        for (const uint64_t page : needed) {
            const PageEntry& entry = open_.dataset->pages[page];
            report_.bytesNeeded += entry.storedBytes + (colour ? entry.colourStoredBytes : 0);
        }
        return {};
    }

    Result<void> compareWithFaultless() {
        renderer_.reset();
        VCP_TRY(ask("comparing", 1));
        VCP_TRY(openRenderer(renderer_, open_.reader));
        const FrameRequest request = requestFor(cameras_.back());
        VCP_TRY_ASSIGN(auto settled, renderer_->settle(request, [&] { return !ask("comparing", 1); }));
        if (auto drawn = renderer_->render(request); !drawn) return drawn.error();
        VCP_TRY_ASSIGN(const auto picture, renderer_->readPicture());
        // A page that was given up by bad luck is drawn from its parent, and reported.
        invariants_.require(picture == picture_ || report_.pagesGivenUp > 0,
                            "the settled picture is not that of a run without faults");
        return {};
    }

    Result<void> compareOrdersOfArrival() {
        if (o_.orders.size() < 2) return {};
        renderer_.reset();
        VCP_TRY_ASSIGN(report_.orders, compareOrders(open_, o_.renderer, requestFor(cameras_.back()), o_.orders,
                                                     kOrderDraws, o_.progress));
        for (const OrderCurve& curve : report_.orders)
            invariants_.require(curve.settled == report_.orders[0].settled,
                                "the settled picture depends on the order of arrival");
        return {};
    }

    Result<void> severalViews() {
        if (o_.views < 2) return {};
        renderer_.reset();
        std::vector<FrameRequest> path;
        for (const Camera& camera : cameras_) path.push_back(requestFor(camera));
        VCP_TRY_ASSIGN(auto together, flyTogether(open_, o_.renderer, path, o_.views, o_.progress));
        for (const std::string& violation : together.violations) invariants_.require(false, violation);
        report_.views = std::move(together);
        return {};
    }

    const OpenDataset& open_;
    const StressOptions& o_;
    StressReport report_;
    Invariants invariants_;
    Clock::time_point start_;
    std::shared_ptr<CountingReader> counted_;
    std::unique_ptr<Renderer> renderer_;
    std::vector<Camera> cameras_;
    glm::dvec3 target_{0};
    Picture picture_;
};

}  // namespace

Result<StressReport> runStress(const OpenDataset& open, const StressOptions& options) {
    return StressRun(open, options).run();
}

}  // namespace vcp
