#include <algorithm>
#include <cmath>

#include "builder/mesh/ply_rows.h"
#include "builder/stream/number_text.h"

namespace vcp {
namespace {

// No text for a number is as long as this.
constexpr size_t kWordLimit = 4096;

// A row is a line, as in the original library: a missing value is found in its own row instead of shifting
// all that follow, and what a line holds beyond the declared properties is ignored (some exporters write
// undeclared lists there).
class AsciiRows final : public PlyRows {
public:
    AsciiRows(ByteSource& source, const PlyPlan& plan) : PlyRows(source, plan) {
        const auto& properties = plan.element->properties;
        columns_.resize(properties.size());
        for (size_t column = 0; column < properties.size(); ++column) {
            columns_[column].isList = properties[column].isList();
            columns_[column].type = properties[column].type;
        }
        if (plan.role == PlyRole::Vertices) {
            for (int axis = 0; axis < 3; ++axis) columns_[plan.positionColumns[axis]].axis = axis;
            for (int axis = 0; plan.normalColumns && axis < 3; ++axis)
                columns_[(*plan.normalColumns)[size_t(axis)]].normalAxis = axis;
            for (int channel = 0; channel < 4; ++channel)
                if (plan.colourColumns[channel]) columns_[*plan.colourColumns[channel]].channel = channel;
        }
        if (plan.role == PlyRole::Faces || plan.role == PlyRole::Strips) columns_[plan.indexColumn].isIndex = true;
        if (columns_.empty()) row_ = plan.element->count;
    }

    Result<void> readSome(MeshChunk& chunk) override {
        VCP_TRY_ASSIGN(const auto text, source_.wholeWindow(afterLastSpace, kWordLimit));
        begin_ = text.data();
        end_ = begin_ + text.size();
        const bool last = text.size() == source_.remaining();
        const char* p = begin_;
        while (!done() && hasRoom(chunk)) {
            if (column_ == columns_.size()) {
                p = std::find_if(p, end_, isLineEnd);
                if (p == end_ && !last) break;
                finishRow(chunk);
                continue;
            }
            const bool rowBegun = column_ > 0 || insideList_;
            p = rowBegun ? skipInLine(p, end_) : skipSpaces(p, end_);
            if (p == end_ && last) return truncated();
            if (p == end_) break;
            if (isLineEnd(*p)) return wrong(byteAt(p), "the line has fewer values than the header declares");
            VCP_TRY(columns_[column_].isList ? takeOfList(p, chunk) : takeScalar(p));
        }
        source_.advance(uint64_t(p - begin_));
        return {};
    }

private:
    struct Column {
        bool isList = false;
        bool isIndex = false;
        int axis = -1;     // 0..2: x, y, z
        int channel = -1;  // 0..3: red, green, blue, alpha
        int normalAxis = -1;
        PlyType type = PlyType::Float32;
    };

    static bool isLineEnd(char c) { return c == '\n' || c == '\r'; }

    static const char* skipInLine(const char* p, const char* end) {
        while (p != end && isSpace(*p) && !isLineEnd(*p)) ++p;
        return p;
    }

    uint64_t byteAt(const char* p) const { return source_.offset() + uint64_t(p - begin_); }

    bool endsWord(const char* p) const { return p && (p == end_ || isSpace(*p)); }

    Error notANumber(const char* p) const { return wrong(byteAt(p), shownWord(p, end_) + " is not a number"); }

    Result<void> takeScalar(const char*& p) {
        const Column& column = columns_[column_++];
        if (column.axis < 0 && column.channel < 0 && column.normalAxis < 0) {
            p = wordEnd(p, end_);
            return {};
        }
        double value = 0;
        const char* const stop = parseReal(p, end_, value);
        if (!endsWord(stop)) return notANumber(p);
        if (column.axis >= 0) {
            if (!std::isfinite(value)) return notFinite(byteAt(p));
            position_[column.axis] = value;
        } else if (column.normalAxis >= 0) {
            normal_[column.normalAxis] = value;
        } else {
            const int shift = 8 * column.channel;
            colour_ = (colour_ & ~(0xFFu << shift)) | Rgba8{colourChannel(column.type, value)} << shift;
        }
        p = stop;
        return {};
    }

    // Takes the length of a list, or its next item.
    Result<void> takeOfList(const char*& p, MeshChunk& chunk) {
        const bool isLength = !insideList_;
        if (!isLength && !columns_[column_].isIndex) {
            p = wordEnd(p, end_);
            endItem();
            return {};
        }
        int64_t integer = 0;
        const char* stop = parseInteger(p, end_, integer);
        std::optional<int64_t> whole = integer;
        if (!endsWord(stop)) {
            double value = 0;
            stop = parseReal(p, end_, value);
            if (!endsWord(stop)) return notANumber(p);
            whole = wholeNumber(value);
        }
        if (isLength) {
            VCP_TRY(beginList(whole, p));
        } else {
            if (!cutter_.add(whole, chunk.triangles)) return badIndex(whole, byteAt(p));
            endItem();
        }
        p = stop;
        return {};
    }

    Result<void> beginList(std::optional<int64_t> length, const char* p) {
        // Every value takes at least a digit and a space.
        const uint64_t fitting = (source_.size() - byteAt(p)) / 2;
        if (!length || *length < 0 || uint64_t(*length) > fitting) return badLength(length, byteAt(p));
        listLeft_ = uint64_t(*length);
        insideList_ = listLeft_ > 0;
        if (!insideList_) ++column_;
        cutter_.beginList();
        return {};
    }

    void endItem() {
        if (--listLeft_ > 0) return;
        insideList_ = false;
        ++column_;
    }

    void finishRow(MeshChunk& chunk) {
        if (plan_.role == PlyRole::Vertices) {
            chunk.positions.push_back(position_);
            if (plan_.hasColour) chunk.colours.push_back(colour_);
            if (plan_.normalColumns) chunk.normals.push_back(packDirection(normal_));
        }
        colour_ = 0xFF000000;
        column_ = 0;
        ++row_;
    }

    std::vector<Column> columns_;
    const char* begin_ = nullptr;  // start of the window, which starts at the cursor
    const char* end_ = nullptr;

    size_t column_ = 0;  // columns_.size(): only the end of the line is left
    bool insideList_ = false;
    uint64_t listLeft_ = 0;
    glm::dvec3 position_{0}, normal_{0};
    Rgba8 colour_ = 0xFF000000;
};

}  // namespace

std::unique_ptr<PlyRows> makePlyAsciiRows(ByteSource& source, const PlyPlan& plan) {
    return std::make_unique<AsciiRows>(source, plan);
}

}  // namespace vcp
