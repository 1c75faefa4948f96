// The lines in which a plane cuts a scan, written as a drawing (viewer/export/section_export.h) in a thread of its own,
// so that the window goes on.
#pragma once

#include <atomic>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "octree/io/byte_reader.h"
#include "render/frame_request.h"
#include "render/similarity.h"
#include "viewer/export/section_export.h"

namespace vcp {

/// One thread calls; destroying it before it is done cancels and waits until that is noticed.
class CutDrawing {
public:
    struct Subject {
        std::shared_ptr<const ByteReader> reader;  ///< of the scan
        Similarity placement;
        SectionPlane plane;  ///< of the world; the drawing is in the scan's own units
        std::optional<LengthUnit> unit;
    };

    /// Begins: the finest level, into a .svg or .dxf.
    CutDrawing(Subject subject, std::filesystem::path output);
    ~CutDrawing();
    CutDrawing(const CutDrawing&) = delete;
    CutDrawing& operator=(const CutDrawing&) = delete;

    [[nodiscard]] const std::filesystem::path& output() const { return output_; }
    [[nodiscard]] double fraction() const { return fraction_; }
    [[nodiscard]] bool isDone() const;
    /// Returns what was written; call it once, when it is done. Errors: those of exportSection and readDataset;
    /// Cancelled.
    Result<SectionFigures> take();

private:
    Result<SectionFigures> write();

    Subject subject_;
    std::filesystem::path output_;
    std::atomic<double> fraction_ = 0;
    std::atomic<bool> cancelled_ = false;
    std::future<Result<SectionFigures>> written_;  // is destroyed first, which waits
};

}  // namespace vcp
