// Draws a .vcp with the renderer until settled, and what that took: the product's side of the benchmarks of pictures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "builder/measure/quantile.h"
#include "octree/io/result.h"
#include "render/frame_request.h"
#include "render/picture_renderer.h"

namespace vcp {

/// What drawing a picture took.
struct PictureCost {
    double cpuMs = 0;                             ///< processor time of a frame, all threads, without loading
    uint64_t bytesRead = 0;                       ///< stored bytes read since startAnew()
    uint64_t residentBytes = 0;                   ///< pages in the pool
    uint32_t coarsestLevel = 0, finestLevel = 0;  ///< levels of the pages that are drawn
};

/// Returns the processor time of this process, all threads.
double processorSeconds();

/// Draws `repetitions` times after a warm-up. Returns the median of the processor times.
template <class Draw>
Result<double> medianCpuMs(int repetitions, const Draw& draw) {
    std::vector<double> seconds;
    for (int repetition = 0; repetition <= repetitions; ++repetition) {
        const double start = processorSeconds();
        VCP_TRY(draw());
        if (repetition > 0) seconds.push_back(processorSeconds() - start);
    }
    return 1e3 * upperQuantile(seconds, 0.5);
}

class CountingReader;

class SettledDrawing {
public:
    struct Options {
        std::string device;  ///< as for --device; empty: the best
        double errorPixels = 0.5;
        uint32_t samples = 1;  ///< of a pixel: the cost is that of all of them
        int repetitions = 3;   ///< frames whose median processor time is reported
        double colourError = kUsualColourError;
    };

    /// Errors: those of createPictureRenderer.
    static Result<std::unique_ptr<SettledDrawing>> create(std::filesystem::path file, const Options& options);

    /// The error, that of colours where it is not the usual one, and the samples where there are several.
    [[nodiscard]] std::string knob() const;
    [[nodiscard]] const std::string& device() const { return renderer_->device().name; }

    /// Forgets what was read, and opens the file. Errors: those of readDataset and of PictureRenderer::open.
    Result<void> startAnew();
    /// Draws the request at the options' error with what is in memory, before what it lacks is read.
    Result<void> drawUnread(FrameRequest request);
    /// Draws the request at the options' error, until settled; renderer() then has the picture.
    Result<PictureCost> draw(FrameRequest request);
    [[nodiscard]] PictureRenderer& renderer() { return *renderer_; }

private:
    SettledDrawing(std::unique_ptr<PictureRenderer> renderer, std::filesystem::path file, const Options& options)
        : renderer_(std::move(renderer)), file_(std::move(file)), options_(options) {}

    [[nodiscard]] FrameRequest withErrors(FrameRequest request) const;

    std::unique_ptr<PictureRenderer> renderer_;
    std::filesystem::path file_;
    Options options_;
    std::shared_ptr<CountingReader> reader_;
};

}  // namespace vcp
