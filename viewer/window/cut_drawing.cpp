#include "viewer/window/cut_drawing.h"

#include <limits>
#include <utility>

#include "octree/dataset_reader.h"
#include "octree/io/caught.h"

namespace vcp {

CutDrawing::CutDrawing(Subject subject, std::filesystem::path output)
    : subject_(std::move(subject)), output_(std::move(output)) {
    thread_ = std::thread([this] {
        written_ = caught([this] { return write(); }, output_.string());
        done_ = true;
    });
}

CutDrawing::~CutDrawing() {
    cancelled_ = true;
    thread_.join();
}

Result<SectionFigures> CutDrawing::take() { return *std::exchange(written_, std::nullopt); }

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
