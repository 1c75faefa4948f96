#include "viewer/window/cut_drawing.h"

#include <chrono>
#include <limits>
#include <utility>

#include "octree/dataset_reader.h"
#include "octree/io/caught.h"

namespace vcp {

CutDrawing::CutDrawing(Subject subject, std::filesystem::path output)
    : subject_(std::move(subject)), output_(std::move(output)) {
    written_ = std::async(std::launch::async, [this] { return caught([this] { return write(); }, output_.string()); });
}

CutDrawing::~CutDrawing() { cancelled_ = true; }

bool CutDrawing::isDone() const { return written_.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }

Result<SectionFigures> CutDrawing::take() { return written_.get(); }

Result<SectionFigures> CutDrawing::write() {
    VCP_TRY_ASSIGN(const auto dataset, readDataset(*subject_.reader));
    const SectionPlane own = planeIn(subject_.placement, subject_.plane);
    const CutPlane plane{own.normal, own.offset};
    const std::string name = subject_.reader->name();
    VCP_TRY_ASSIGN(const auto cut, SurfaceCut::create(dataset, name, std::numeric_limits<uint32_t>::max(), {}, plane));
    SectionExportOptions options;
    options.output = output_;
    options.kind = outputKindOf(output_).value_or(OutputKind::Svg);
    options.rules.inputs = {name};
    options.notes = {{"source", std::filesystem::path(name).filename().string()},
                     {"unit", subject_.unit ? std::string(subject_.unit->name) : "unknown"}};
    options.plane = plane;
    options.unit = subject_.unit;
    options.stream.colour = false;
    options.stream.progress = [this](double fraction) {
        fraction_ = fraction;
        return !cancelled_;
    };
    return exportSection(*subject_.reader, cut, options);
}

}  // namespace vcp
