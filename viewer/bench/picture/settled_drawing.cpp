#include "viewer/bench/picture/settled_drawing.h"

#include <atomic>
#include <ctime>

#include <fmt/format.h>

#include "octree/dataset_reader.h"
#include "octree/io/byte_reader.h"
#include "streaming/page_source.h"

namespace vcp {

/// A file whose bytes are counted as they are read.
class CountingReader final : public ByteReader {
public:
    explicit CountingReader(std::shared_ptr<ByteReader> file) : file_(std::move(file)) {}
    Result<void> read(uint64_t offset, std::span<std::byte> bytes) const override {
        bytes_ += bytes.size();
        return file_->read(offset, bytes);
    }
    [[nodiscard]] uint64_t size() const override { return file_->size(); }
    [[nodiscard]] const std::string& name() const override { return file_->name(); }
    [[nodiscard]] uint64_t bytes() const { return bytes_; }

private:
    std::shared_ptr<ByteReader> file_;
    mutable std::atomic<uint64_t> bytes_{0};
};

double processorSeconds() {
    std::timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

Result<std::unique_ptr<SettledDrawing>> SettledDrawing::create(std::filesystem::path file, const Options& options) {
    RendererOptions made;
    made.device = options.device;
    made.budgetBytes = uint64_t{2} << 30;
    VCP_TRY_ASSIGN(auto renderer, createPictureRenderer(made));
    return std::unique_ptr<SettledDrawing>(new SettledDrawing(std::move(renderer), std::move(file), options));
}

std::string SettledDrawing::knob() const {
    const std::string samples = options_.samples > 1 ? fmt::format(", samples {}", options_.samples) : "";
    const std::string colours =
        options_.colourError != kUsualColourError ? fmt::format(", colour-error {:g}", options_.colourError) : "";
    return fmt::format("error-pixels {:g}{}{}", options_.errorPixels, colours, samples);
}

Result<void> SettledDrawing::startAnew() {
    VCP_TRY_ASSIGN(auto file, openFile(file_));
    reader_ = std::make_shared<CountingReader>(file);
    VCP_TRY_ASSIGN(auto dataset, readDataset(*reader_));
    const auto shared = std::make_shared<const Dataset>(std::move(dataset));
    PlacedDataset placed;
    placed.dataset = shared;
    placed.source = std::make_shared<FilePageSource>(reader_, shared);
    return renderer_->open({placed}, {});
}

FrameRequest SettledDrawing::withErrors(FrameRequest request) const {
    request.errorPixels = options_.errorPixels;
    request.colourError = colourErrorIn(request.shading.mode, options_.colourError);
    return request;
}

Result<void> SettledDrawing::drawUnread(FrameRequest request) {
    request = withErrors(request);
    VCP_TRY(renderer_->update(request));
    VCP_TRY(renderer_->render(request));
    return renderer_->refineTo(options_.samples, request);
}

Result<PictureCost> SettledDrawing::draw(FrameRequest request) {
    request = withErrors(request);
    VCP_TRY_ASSIGN(const auto settled, renderer_->settle(request));
    PictureCost cost{0, reader_->bytes(), settled.residentBytes, settled.coarsestLevel, settled.finestLevel};
    VCP_TRY_ASSIGN(cost.cpuMs, medianCpuMs(options_.repetitions, [&]() -> Result<void> {
                       VCP_TRY(renderer_->render(request));
                       return renderer_->refineTo(options_.samples, request);
                   }));
    return cost;
}

}  // namespace vcp
