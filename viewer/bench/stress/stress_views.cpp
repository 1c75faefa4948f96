#include "viewer/bench/stress/stress_views.h"

#include <algorithm>
#include <chrono>

namespace vcp {

namespace {

using Clock = std::chrono::steady_clock;

// Views to which nothing new has come for so long do not settle any more.
constexpr double kHopelessSeconds = 60;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

class ViewsRun {
public:
    ViewsRun(const OpenDataset& open, const RendererOptions& options, const std::vector<FrameRequest>& path, int views)
        : open_(open), options_(options), path_(path) {
        result_.views = views;
    }

    Result<StressViews> run(const std::function<bool(const std::string& what, double fraction)>& progress) {
        VCP_TRY(start());
        for (size_t frame = 0; frame < path_.size(); ++frame) {
            if (!progress("flying together", double(frame) / double(path_.size()))) return Error::cancelled();
            for (size_t view = 0; view < views_.size(); ++view) {
                VCP_TRY(update(view, frame));
                if (auto drawn = views_[view]->render(requestOf(view, frame)); !drawn) return drawn.error();
            }
        }
        VCP_TRY(settle(progress));
        VCP_TRY(compareWithOneAlone());
        return std::move(result_);
    }

private:
    [[nodiscard]] const FrameRequest& requestOf(size_t view, size_t frame) const {
        return path_[(frame + view * path_.size() / size_t(result_.views)) % path_.size()];
    }

    Result<void> start() {
        VCP_TRY_ASSIGN(auto first, Renderer::create(options_));
        views_.push_back(std::move(first));
        VCP_TRY(views_[0]->open(open_.dataset, open_.source));
        while (views_.size() < size_t(result_.views)) {
            VCP_TRY_ASSIGN(auto more, views_[0]->addView());
            views_.push_back(std::move(more));
        }
        last_.resize(views_.size());
        return {};
    }

    Result<void> update(size_t view, size_t frame) {
        VCP_TRY_ASSIGN(auto update, views_[view]->update(requestOf(view, frame)));
        require(update.residentBytes <= options_.budgetBytes,
                "several views: more bytes are resident than the budget allows");
        require(update.heldBytesMax <= options_.ramBytes,
                "several views: pages on their way and kept take more memory than --ram allows");
        require(update.reloads == 0, "several views: a page was loaded twice in still views");
        result_.residentBytesMax = std::max(result_.residentBytesMax, update.residentBytes);
        result_.loads = update.loads;
        result_.pagesResident = update.pagesResident;
        last_[view] = std::move(update);
        return {};
    }

    Result<void> settle(const std::function<bool(const std::string& what, double fraction)>& progress) {
        const auto began = Clock::now();
        auto changedAt = began;
        uint64_t read = 0;
        for (bool settled = false; !settled;) {
            for (size_t view = 0; view < views_.size(); ++view) {
                VCP_TRY(update(view, path_.size() - 1));
                if (last_[view].awaitsRays) VCP_TRY(views_[view]->render(requestOf(view, path_.size() - 1)));
            }
            settled =
                std::all_of(last_.begin(), last_.end(), [](const UpdateResult& update) { return update.settled; });
            if (last_[0].bytesRead != read) changedAt = Clock::now();
            read = last_[0].bytesRead;
            require(secondsSince(changedAt) < kHopelessSeconds, "several views: they do not settle");
            if (settled || secondsSince(changedAt) >= kHopelessSeconds) break;
            if (!progress("settling together", 1)) return Error::cancelled();
            views_[0]->waitForPage(std::chrono::milliseconds(20));
        }
        result_.settledSeconds = secondsSince(began);
        for (const UpdateResult& update : last_) {
            result_.pagesWanted += update.pagesWanted;
            result_.relaxed += update.relaxed ? 1 : 0;
        }
        return {};
    }

    Result<void> compareWithOneAlone() {
        std::vector<Picture> together;
        for (size_t view = 0; view < views_.size(); ++view) {
            VCP_TRY_ASSIGN(auto picture, draw(*views_[view], view));
            together.push_back(std::move(picture));
        }
        views_.resize(1);
        for (size_t view = 0; view < together.size(); ++view) {
            if (auto settled = views_[0]->settle(requestOf(view, path_.size() - 1)); !settled) return settled.error();
            VCP_TRY_ASSIGN(const auto alone, draw(*views_[0], view));
            const bool same = alone == together[view];
            result_.identical += same ? 1 : 0;
            require(same || last_[view].relaxed, "several views: one does not show what it shows alone");
        }
        return {};
    }

    Result<Picture> draw(Renderer& renderer, size_t view) const {
        if (auto drawn = renderer.render(requestOf(view, path_.size() - 1)); !drawn) return drawn.error();
        return renderer.readPicture();
    }

    void require(bool holds, const std::string& otherwise) {
        auto& noted = result_.violations;
        if (!holds && std::find(noted.begin(), noted.end(), otherwise) == noted.end()) noted.push_back(otherwise);
    }

    const OpenDataset& open_;
    const RendererOptions& options_;
    const std::vector<FrameRequest>& path_;
    std::vector<std::unique_ptr<Renderer>> views_;
    std::vector<UpdateResult> last_;
    StressViews result_;
};

}  // namespace

Result<StressViews> flyTogether(const OpenDataset& open, const RendererOptions& options,
                                const std::vector<FrameRequest>& path, int views,
                                const std::function<bool(const std::string& what, double fraction)>& progress) {
    return ViewsRun(open, options, path, views).run([&](const std::string& what, double fraction) {
        return !progress || progress(what, fraction);
    });
}

}  // namespace vcp
