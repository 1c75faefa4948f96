#include "builder/mesh/ply.h"

#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "builder/mesh/ply_header.h"
#include "builder/mesh/ply_rows.h"
#include "builder/stream/number_text.h"

namespace vcp {
namespace {

std::string_view formatName(PlyEncoding encoding) {
    switch (encoding) {
        case PlyEncoding::Ascii:
            return "PLY ASCII";
        case PlyEncoding::LittleEndian:
            return "PLY binary little endian";
        case PlyEncoding::BigEndian:
            return "PLY binary big endian";
    }
    return "PLY";
}

Error elementError(const ByteSource& source, const PlyElement& element, std::string message) {
    return source.error(ErrorCode::InvalidInput, "element " + shown(element.name), element.headerByte,
                        std::move(message));
}

// Checks that the file has the bytes that the header promises. Names the first missing row when rows of one size make
// that certain.
Result<void> checkCounts(const ByteSource& source, const PlyHeader& header) {
    const bool ascii = header.encoding == PlyEncoding::Ascii;
    uint64_t left = source.remaining() + (ascii ? 1 : 0);  // the last line may lack its end
    bool exact = !ascii;
    for (const PlyElement& element : header.elements) {
        const uint64_t rowBytes = element.leastBytes(header.encoding);
        exact = exact && !element.hasLists();
        if (rowBytes > 0 && element.count > left / rowBytes) {
            if (!source.sizeKnown())
                return elementError(source, element,
                                    fmt::format("declares {} rows, more than any file can hold", element.count));
            const uint64_t whole = left / rowBytes;
            std::string message = fmt::format(
                "the header declares {} rows of {} {} bytes, but the file ends after {} of them: "
                "it is truncated or the count is wrong",
                element.count, exact ? "exactly" : "at least", rowBytes,
                exact ? std::to_string(whole) : fmt::format("at most {}", whole));
            if (!exact) return elementError(source, element, std::move(message));
            return source.error(ErrorCode::InvalidInput, fmt::format("{} {}", element.name, whole),
                                source.size() - left % rowBytes, std::move(message));
        }
        left -= element.count * rowBytes;
    }
    return {};
}

std::optional<size_t> scalarColumn(const PlyElement& element, std::string_view name) {
    const PlyProperty* const property = element.find(name);
    if (!property || property->isList()) return std::nullopt;
    return size_t(property - element.properties.data());
}

// Colour has three spellings; it counts when red, green and blue are there.
void planColours(const PlyElement& element, PlyPlan& plan) {
    static constexpr std::array<std::array<std::string_view, 4>, 3> kSpellings{{
        {"red", "green", "blue", "alpha"},
        {"diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"},
        {"r", "g", "b", "a"},
    }};
    for (const auto& spelling : kSpellings) {
        std::array<std::optional<size_t>, 4> columns;
        for (size_t channel = 0; channel < 4; ++channel) columns[channel] = scalarColumn(element, spelling[channel]);
        if (!columns[0] || !columns[1] || !columns[2]) continue;
        if (!columns[3]) columns[3] = scalarColumn(element, "alpha");
        plan.colourColumns = columns;
        plan.hasColour = true;
        return;
    }
}

void planNormals(const PlyElement& element, PlyPlan& plan) {
    const auto x = scalarColumn(element, "nx"), y = scalarColumn(element, "ny"), z = scalarColumn(element, "nz");
    if (x && y && z) plan.normalColumns = {*x, *y, *z};
}

Result<PlyPlan> planElement(const ByteSource& source, const PlyElement& element, uint64_t vertexCount) {
    PlyPlan plan;
    plan.element = &element;
    plan.vertexCount = vertexCount;
    if (element.name == "vertex") {
        plan.role = PlyRole::Vertices;
        for (size_t axis = 0; axis < 3; ++axis) {
            const std::string_view name = std::string_view("xyz").substr(axis, 1);
            const auto column = scalarColumn(element, name);
            if (!column) return elementError(source, element, fmt::format("has no scalar property '{}'", name));
            plan.positionColumns[axis] = *column;
        }
        planColours(element, plan);
        planNormals(element, plan);
    } else if (element.name == "face" || element.name == "tristrips") {
        plan.role = element.name == "face" ? PlyRole::Faces : PlyRole::Strips;
        const PlyProperty* list = element.find("vertex_indices");
        if (!list) list = element.find("vertex_index");
        if (!list || !list->isList())
            return elementError(source, element, "has no list property 'vertex_indices' or 'vertex_index'");
        plan.indexColumn = size_t(list - element.properties.data());
    }
    return plan;
}

class PlyStream final : public MeshStream {
public:
    PlyStream(ByteSource source, PlyHeader header) : source_(std::move(source)), header_(std::move(header)) {}

    Result<void> plan() {
        const PlyElement* const vertices = header_.find("vertex");
        if (!vertices || vertices->count == 0)
            return source_.error(ErrorCode::InvalidInput, "", std::nullopt, "has no vertices");
        const PlyElement* const faces = header_.find("face");
        const PlyElement* const strips = header_.find("tristrips");
        if ((!faces || faces->count == 0) && (!strips || strips->count == 0))
            return source_.error(ErrorCode::InvalidInput, "", std::nullopt,
                                 "has no faces, only points or lines; reconstruct a surface first");
        VCP_TRY(checkCounts(source_, header_));
        for (const PlyElement& element : header_.elements) {
            if (element.count == 0) continue;
            VCP_TRY_ASSIGN(auto planned, planElement(source_, element, vertices->count));
            info_.hasColour = info_.hasColour || planned.hasColour;
            plans_.push_back(planned);
        }
        info_.format = formatName(header_.encoding);
        info_.fileBytes = source_.fileBytes();
        info_.vertices = vertices->count;
        if (!strips || strips->count == 0) info_.faces = faces->count;
        return {};
    }

    [[nodiscard]] const MeshInfo& info() const override { return info_; }
    [[nodiscard]] uint64_t bytesRead() const override { return source_.fileBytesRead(); }

    Result<bool> next(MeshChunk& chunk) override {
        chunk.clear();
        while (hasRoom(chunk)) {
            if (rows_ && rows_->done()) rows_.reset();
            if (!rows_ && planned_ == plans_.size()) break;
            if (!rows_) rows_ = makeRows(plans_[planned_++]);
            VCP_TRY(rows_->readSome(chunk));
        }
        return !isEmpty(chunk);
    }

private:
    std::unique_ptr<PlyRows> makeRows(const PlyPlan& plan) {
        return header_.encoding == PlyEncoding::Ascii ? makePlyAsciiRows(source_, plan)
                                                      : makePlyBinaryRows(source_, plan, header_.encoding);
    }

    ByteSource source_;
    PlyHeader header_;
    MeshInfo info_;
    std::vector<PlyPlan> plans_;  // plans of the elements that have rows
    size_t planned_ = 0;          // plans that were started
    std::unique_ptr<PlyRows> rows_;
};

}  // namespace

Result<std::unique_ptr<MeshStream>> openPly(ByteSource source) {
    VCP_TRY_ASSIGN(auto header, readPlyHeader(source));
    auto stream = std::make_unique<PlyStream>(std::move(source), std::move(header));
    VCP_TRY(stream->plan());
    return std::unique_ptr<MeshStream>(std::move(stream));
}

}  // namespace vcp
