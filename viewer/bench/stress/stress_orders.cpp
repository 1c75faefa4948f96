#include "viewer/bench/stress/stress_orders.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>

namespace vcp {

namespace {

using Clock = std::chrono::steady_clock;

double rmsDifference(const Picture& a, const Picture& b) {
    double sum = 0;
    for (size_t i = 0; i < a.rgba.size(); ++i) {
        const double difference = double(a.rgba[i]) - double(b.rgba[i]);
        sum += i % 4 == 3 ? 0 : difference * difference;
    }
    return std::sqrt(sum / std::max<double>(1, double(a.rgba.size()) * 0.75));
}

/// Draws the pictures of one order on its way, until it has settled.
class OrderRun {
public:
    OrderRun(const OpenDataset& open, RendererOptions options, const FrameRequest& request, LoadOrder order, int draws)
        : open_(open), options_(std::move(options)), request_(request), draws_(draws) {
        curve_.order = options_.order = order;
    }

    Result<OrderCurve> run(const std::function<bool(double)>& progress) {
        VCP_TRY(start());
        uint64_t drawnAt = 0, step = 1;
        for (;;) {
            VCP_TRY_ASSIGN(const auto update, renderer_->update(request_));
            step = std::max<uint64_t>(1, update.pagesWanted / uint64_t(draws_));
            const bool isDue = pictures_.empty() || update.settled || update.awaitsRays;
            if (update.drawable && (isDue || update.loads >= drawnAt + step)) {
                drawnAt = update.loads;
                VCP_TRY(draw(update));
            }
            if (update.settled) break;
            if (update.awaitsRays) continue;
            if (!progress(1 - double(update.pagesMissing) / std::max(1u, update.pagesWanted)))
                return Error::cancelled();
            renderer_->waitForPage(std::chrono::milliseconds(20));
        }
        return finish();
    }

private:
    Result<void> start() {
        // There is memory for one page on its way: none is read before those drawn so far could ask for others.
        const auto source = std::make_shared<FilePageSource>(open_.reader, open_.dataset, 0);
        const bool colour = options_.colour && open_.dataset->hasColour();
        options_.loaderThreads = 1;
        options_.ramBytes = options_.uploadBytes = 1;
        for (uint64_t page = 0; page < open_.dataset->pages.size(); ++page)
            options_.ramBytes = std::max(options_.ramBytes, source->bytesToRead(page, colour));
        VCP_TRY_ASSIGN(renderer_, Renderer::create(options_));
        start_ = Clock::now();
        return renderer_->open(open_.dataset, source);
    }

    Result<void> draw(const UpdateResult& update) {
        if (auto drawn = renderer_->render(request_); !drawn) return drawn.error();
        VCP_TRY_ASSIGN(auto picture, renderer_->readPicture());
        pictures_.push_back(std::move(picture));
        curve_.samples.push_back({std::chrono::duration<double>(Clock::now() - start_).count(), update.bytesRead, 0});
        return {};
    }

    OrderCurve finish() {
        if (pictures_.empty()) return std::move(curve_);
        curve_.settled = pictures_.back();
        std::vector<OrderSample>& samples = curve_.samples;
        for (size_t i = 0; i < pictures_.size(); ++i) samples[i].error = rmsDifference(pictures_[i], curve_.settled);
        double area = 0;
        // A picture counts until the next one is drawn.
        for (size_t i = 0; i + 1 < samples.size(); ++i)
            area += samples[i].error * double(samples[i + 1].bytes - samples[i].bytes);
        curve_.meanError = area / std::max<double>(1, double(samples.back().bytes - samples.front().bytes));
        size_t last = samples.size() - 1;
        while (last > 0 && samples[last - 1].error < 0.1 * samples[0].error) --last;
        curve_.bytesToTenth = samples[last].bytes;
        return std::move(curve_);
    }

    const OpenDataset& open_;
    RendererOptions options_;
    const FrameRequest& request_;
    int draws_;
    std::unique_ptr<Renderer> renderer_;
    Clock::time_point start_;
    std::vector<Picture> pictures_;
    OrderCurve curve_;
};

}  // namespace

Result<std::vector<OrderCurve>> compareOrders(
    const OpenDataset& open, const RendererOptions& options, const FrameRequest& request,
    const std::vector<LoadOrder>& orders, int draws,
    const std::function<bool(const std::string& what, double fraction)>& progress) {
    // All entries are read: the largest page says how much memory one takes.
    VCP_TRY_ASSIGN(auto dataset, readDataset(*open.reader));
    OpenDataset whole = open;
    whole.dataset = std::make_shared<const Dataset>(std::move(dataset));
    std::vector<OrderCurve> curves;
    for (const LoadOrder order : orders) {
        const std::string what = fmt::format("order {}", nameOf(order));
        VCP_TRY_ASSIGN(auto curve, OrderRun(whole, options, request, order, draws).run([&](double fraction) {
            return !progress || progress(what, fraction);
        }));
        curves.push_back(std::move(curve));
    }
    return curves;
}

std::optional<std::vector<LoadOrder>> parseOrders(std::string_view text) {
    std::vector<LoadOrder> orders;
    while (true) {
        const size_t comma = text.find(',');
        const auto order = loadOrderNamed(text.substr(0, comma));
        if (!order) return std::nullopt;
        orders.push_back(*order);
        if (comma == std::string_view::npos) return orders;
        text.remove_prefix(comma + 1);
    }
}

}  // namespace vcp
