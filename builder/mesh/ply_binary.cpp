#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "builder/mesh/ply_rows.h"

namespace vcp {
namespace {

template <class T>
T swapped(T value) {
    auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
    std::ranges::reverse(bytes);
    return std::bit_cast<T>(bytes);
}

template <class T, bool kSwap>
T load(const char* p) {
    T value;
    std::memcpy(&value, p, sizeof(T));
    if constexpr (kSwap && sizeof(T) > 1) value = swapped(value);
    return value;
}

/// Calls `use` with the scalar at p, in its own type.
template <bool kSwap, class Use>
auto loadScalar(PlyType type, const char* p, Use use) {
    switch (type) {
        case PlyType::Int8:
            return use(load<int8_t, kSwap>(p));
        case PlyType::Uint8:
            return use(load<uint8_t, kSwap>(p));
        case PlyType::Int16:
            return use(load<int16_t, kSwap>(p));
        case PlyType::Uint16:
            return use(load<uint16_t, kSwap>(p));
        case PlyType::Int32:
            return use(load<int32_t, kSwap>(p));
        case PlyType::Uint32:
            return use(load<uint32_t, kSwap>(p));
        case PlyType::Float32:
            return use(load<float, kSwap>(p));
        case PlyType::Float64:
            break;
    }
    return use(load<double, kSwap>(p));
}

template <bool kSwap>
double loadReal(PlyType type, const char* p) {
    return loadScalar<kSwap>(type, p, [](auto value) -> double { return value; });
}

template <bool kSwap>
std::optional<int64_t> loadWhole(PlyType type, const char* p) {
    return loadScalar<kSwap>(type, p, [](auto value) -> std::optional<int64_t> {
        if constexpr (std::is_floating_point_v<decltype(value)>)
            return wholeNumber(value);
        else
            return value;
    });
}

// A part of a row as stored: a run of scalars, or a list between runs.
struct Step {
    bool isList = false;
    size_t column = 0;       // column of a list
    uint64_t bytes = 0;      // bytes of a run
    uint64_t rowOffset = 0;  // for a run: scalar bytes of the row before it
};

// Where a face row of the usual kind (with one list) has its list.
struct FaceLayout {
    size_t before = 0;
    size_t after = 0;
    uint64_t vertexCount = 0;
};

// Decodes triangles from the start of a row until the input or `room` ends or a row is not plain: no
// triangle, or an index out of range. Returns how many; `p` is left at the first row not taken.
template <class Count, class Index, bool kSwap>
size_t takeTriangles(const FaceLayout& layout, const char*& p, const char* end, std::array<uint64_t, 3>* out,
                     size_t room) {
    const size_t rowBytes = layout.before + sizeof(Count) + 3 * sizeof(Index) + layout.after;
    const char* row = p;
    size_t taken = 0;
    while (taken < room && size_t(end - row) >= rowBytes) {
        const char* const list = row + layout.before;
        if (load<Count, kSwap>(list) != 3) break;
        const char* const items = list + sizeof(Count);
        // A negative index becomes a huge one.
        const auto a = uint64_t(int64_t{load<Index, kSwap>(items)});
        const auto b = uint64_t(int64_t{load<Index, kSwap>(items + sizeof(Index))});
        const auto c = uint64_t(int64_t{load<Index, kSwap>(items + 2 * sizeof(Index))});
        if (std::max({a, b, c}) >= layout.vertexCount) break;
        out[taken++] = {a, b, c};
        row += rowBytes;
    }
    p = row;
    return taken;
}

using TakeTriangles = size_t (*)(const FaceLayout&, const char*&, const char*, std::array<uint64_t, 3>*, size_t);

template <bool kSwap>
TakeTriangles takerFor(PlyType count, PlyType index) {
    const bool byteCount = count == PlyType::Uint8 || count == PlyType::Int8;
    const bool wordCount = count == PlyType::Uint32 || count == PlyType::Int32;
    if (index == PlyType::Int32 && byteCount) return takeTriangles<uint8_t, int32_t, kSwap>;
    if (index == PlyType::Int32 && wordCount) return takeTriangles<uint32_t, int32_t, kSwap>;
    if (index == PlyType::Uint32 && byteCount) return takeTriangles<uint8_t, uint32_t, kSwap>;
    if (index == PlyType::Uint32 && wordCount) return takeTriangles<uint32_t, uint32_t, kSwap>;
    return nullptr;
}

template <bool kSwap>
class BinaryRows final : public PlyRows {
public:
    BinaryRows(ByteSource& source, const PlyPlan& plan) : PlyRows(source, plan) {
        planSteps();
        planVertices();
        planFaces();
    }

    Result<void> readSome(MeshChunk& chunk) override {
        if (fixedRows_ && plan_.role == PlyRole::Skip) return skipRows();
        if (fixedRows_) return readVertices(chunk);
        return walkRows(chunk);
    }

private:
    void planSteps() {
        const auto& properties = plan_.element->properties;
        uint64_t rowOffset = 0;
        for (size_t column = 0; column < properties.size(); ++column) {
            scalarOffsets_.push_back(rowOffset);
            if (properties[column].isList()) {
                steps_.push_back({true, column, 0, rowOffset});
                continue;
            }
            if (steps_.empty() || steps_.back().isList) steps_.push_back({false, column, 0, rowOffset});
            const size_t bytes = byteSize(properties[column].type);
            steps_.back().bytes += bytes;
            rowOffset += bytes;
        }
        rowBytes_ = rowOffset;
        fixedRows_ = !plan_.element->hasLists();
    }

    void planVertices() {
        if (plan_.role != PlyRole::Vertices) return;
        const auto& properties = plan_.element->properties;
        const auto typeAt = [&](size_t axis) { return properties[plan_.positionColumns[axis]].type; };
        if (typeAt(0) == typeAt(1) && typeAt(1) == typeAt(2)) positionType_ = typeAt(0);
        byteColours_ = plan_.hasColour;
        for (const auto& column : plan_.colourColumns)
            byteColours_ = byteColours_ && (!column || properties[*column].type == PlyType::Uint8);
        scalarRow_.resize(rowBytes_);
    }

    void planFaces() {
        if (plan_.role != PlyRole::Faces) return;
        if (std::ranges::count_if(steps_, &Step::isList) != 1) return;
        const PlyProperty& list = plan_.element->properties[plan_.indexColumn];
        takeTriangles_ = takerFor<kSwap>(*list.countType, list.type);
        faceLayout_.vertexCount = plan_.vertexCount;
        faceLayout_.before = scalarOffsets_[plan_.indexColumn];
        faceLayout_.after = rowBytes_ - faceLayout_.before;
    }

    Result<void> skipRows() {
        const uint64_t rows = plan_.element->count - row_;
        if (rowBytes_ == 0) {
            row_ += rows;
            return {};
        }
        const uint64_t possible = std::min(rows, source_.remaining() / rowBytes_);
        VCP_TRY_ASSIGN(const auto skipped, source_.skip(possible * rowBytes_));
        row_ += skipped / rowBytes_;
        return done() ? Result<void>() : truncated();
    }

    Result<void> readVertices(MeshChunk& chunk) {
        VCP_TRY_ASSIGN(const auto bytes, source_.window(rowBytes_));
        const uint64_t room = kChunkElements - chunk.positions.size();
        const auto rows = size_t(std::min({room, plan_.element->count - row_, uint64_t{bytes.size() / rowBytes_}}));
        if (rows == 0) return truncated();
        VCP_TRY(decodeVertices(bytes.data(), rows, chunk));
        source_.advance(rows * rowBytes_);
        row_ += rows;
        return {};
    }

    // Decodes `p`, which holds whole rows of scalars that begin at the cursor.
    Result<void> decodeVertices(const char* p, size_t rows, MeshChunk& chunk) {
        const size_t before = chunk.positions.size();
        chunk.positions.resize(before + rows);
        glm::dvec3* const positions = chunk.positions.data() + before;
        size_t finite = 0;
        if (positionType_ == PlyType::Float32)
            finite = decodePositions<float>(p, rows, positions);
        else if (positionType_ == PlyType::Float64)
            finite = decodePositions<double>(p, rows, positions);
        else
            finite = decodeMixedPositions(p, rows, positions);
        if (finite < rows) {
            row_ += finite;
            return notFinite(firstNonFiniteByte(positions[finite], finite));
        }
        if (plan_.hasColour) decodeColours(p, rows, chunk);
        if (plan_.normalColumns) decodeNormals(p, rows, chunk);
        return {};
    }

    // Both functions return how many leading rows are finite; the row after them is decoded, the rest is not.
    template <class T>
    size_t decodePositions(const char* p, size_t rows, glm::dvec3* out) const {
        const uint64_t x = scalarOffsets_[plan_.positionColumns[0]];
        const uint64_t y = scalarOffsets_[plan_.positionColumns[1]];
        const uint64_t z = scalarOffsets_[plan_.positionColumns[2]];
        for (size_t row = 0; row < rows; ++row, p += rowBytes_) {
            out[row] = {load<T, kSwap>(p + x), load<T, kSwap>(p + y), load<T, kSwap>(p + z)};
            if (!isFinite(out[row])) return row;
        }
        return rows;
    }

    size_t decodeMixedPositions(const char* p, size_t rows, glm::dvec3* out) const {
        for (size_t row = 0; row < rows; ++row, p += rowBytes_) {
            for (int axis = 0; axis < 3; ++axis) out[row][axis] = scalar(p, plan_.positionColumns[axis]);
            if (!isFinite(out[row])) return row;
        }
        return rows;
    }

    void decodeColours(const char* p, size_t rows, MeshChunk& chunk) const {
        const size_t before = chunk.colours.size();
        chunk.colours.resize(before + rows);
        for (size_t row = 0; row < rows; ++row, p += rowBytes_) {
            Rgba8 colour = 0xFF000000;
            for (size_t channel = 0; channel < 4; ++channel) {
                const auto column = plan_.colourColumns[channel];
                if (!column) continue;
                const auto value = byteColours_
                                       ? load<uint8_t, kSwap>(p + scalarOffsets_[*column])
                                       : colourChannel(plan_.element->properties[*column].type, scalar(p, *column));
                colour &= ~(0xFFu << (8 * channel));
                colour |= Rgba8{value} << (8 * channel);
            }
            chunk.colours[before + row] = colour;
        }
    }

    void decodeNormals(const char* p, size_t rows, MeshChunk& chunk) const {
        const auto& [x, y, z] = *plan_.normalColumns;
        for (size_t row = 0; row < rows; ++row, p += rowBytes_)
            chunk.normals.push_back(packDirection({scalar(p, x), scalar(p, y), scalar(p, z)}));
    }

    double scalar(const char* row, size_t column) const {
        return loadReal<kSwap>(plan_.element->properties[column].type, row + scalarOffsets_[column]);
    }

    static bool isFinite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

    uint64_t firstNonFiniteByte(const glm::dvec3& position, size_t row) const {
        size_t axis = 0;
        while (axis < 2 && std::isfinite(position[int(axis)])) ++axis;
        if (!fixedRows_) return positionBytes_[axis];
        return source_.offset() + row * rowBytes_ + scalarOffsets_[plan_.positionColumns[axis]];
    }

    // Rows with lists are walked step by step, and can be resumed at every list item.
    Result<void> walkRows(MeshChunk& chunk) {
        VCP_TRY_ASSIGN(const auto bytes, source_.window(std::max<uint64_t>(rowBytes_, sizeof(double))));
        const char* const begin = bytes.data();
        const char* const end = begin + bytes.size();
        const char* p = begin;
        while (!done() && hasRoom(chunk)) {
            if (step_ == 0 && !insideList_ && takeTriangles_) takePlainTriangles(p, end, chunk);
            if (done() || !hasRoom(chunk)) break;
            const char* const at = p;
            const size_t stepBefore = step_;
            VCP_TRY(walkStep(p, end, source_.offset() + uint64_t(p - begin), chunk));
            if (p == at && step_ == stepBefore) break;  // a step needs more than the window holds
        }
        if (p == begin && !done() && hasRoom(chunk)) return truncated();
        source_.advance(uint64_t(p - begin));
        return {};
    }

    void takePlainTriangles(const char*& p, const char* end, MeshChunk& chunk) {
        std::array<std::array<uint64_t, 3>, 256> batch;
        size_t taken = 0;
        do {
            const uint64_t room =
                std::min<uint64_t>(kChunkElements - chunk.triangles.size(), plan_.element->count - row_);
            taken = takeTriangles_(faceLayout_, p, end, batch.data(), std::min<uint64_t>(batch.size(), room));
            chunk.triangles.insert(chunk.triangles.end(), batch.begin(), batch.begin() + ptrdiff_t(taken));
            row_ += taken;
        } while (taken == batch.size());
    }

    // Takes one run, one list length, or what the input and the chunk hold of one list. `byte` is the offset of `p`.
    Result<void> walkStep(const char*& p, const char* end, uint64_t byte, MeshChunk& chunk) {
        const Step& step = steps_[step_];
        const auto available = uint64_t(end - p);
        if (!step.isList) {
            if (available < step.bytes) return {};
            if (plan_.role == PlyRole::Vertices) keepRun(step, p, byte);
            p += step.bytes;
            return finishStep(chunk);
        }
        const PlyProperty& list = plan_.element->properties[step.column];
        if (!insideList_) {
            if (available < byteSize(*list.countType)) return {};
            VCP_TRY(beginList(list, p, byte));
            if (listLeft_ > 0) return {};
        } else {
            VCP_TRY(takeItems(list, step.column, p, end, byte, chunk));
        }
        if (listLeft_ > 0) return {};
        insideList_ = false;
        return finishStep(chunk);
    }

    Result<void> beginList(const PlyProperty& list, const char*& p, uint64_t byte) {
        const auto length = loadWhole<kSwap>(*list.countType, p);
        const size_t lengthBytes = byteSize(*list.countType);
        const uint64_t left = source_.size() - byte - lengthBytes;
        if (!length || *length < 0 || uint64_t(*length) > left / byteSize(list.type)) return badLength(length, byte);
        p += lengthBytes;
        listLeft_ = uint64_t(*length);
        insideList_ = true;
        cutter_.beginList();
        return {};
    }

    Result<void> takeItems(const PlyProperty& list, size_t column, const char*& p, const char* end, uint64_t byte,
                           MeshChunk& chunk) {
        const size_t itemBytes = byteSize(list.type);
        const uint64_t here = std::min(listLeft_, uint64_t(end - p) / itemBytes);
        const bool names =
            column == plan_.indexColumn && (plan_.role == PlyRole::Faces || plan_.role == PlyRole::Strips);
        if (!names) {
            p += here * itemBytes;
            listLeft_ -= here;
            return {};
        }
        const char* const begin = p;
        for (uint64_t i = 0; i < here && hasRoom(chunk); ++i, p += itemBytes, --listLeft_) {
            const auto number = loadWhole<kSwap>(list.type, p);
            if (!cutter_.add(number, chunk.triangles)) return badIndex(number, byte + uint64_t(p - begin));
        }
        return {};
    }

    // A vertex row with lists: its scalars are gathered into one row without them.
    void keepRun(const Step& step, const char* p, uint64_t byte) {
        std::memcpy(scalarRow_.data() + step.rowOffset, p, step.bytes);
        for (size_t axis = 0; axis < 3; ++axis) {
            const uint64_t offset = scalarOffsets_[plan_.positionColumns[axis]];
            if (offset >= step.rowOffset && offset < step.rowOffset + step.bytes)
                positionBytes_[axis] = byte + offset - step.rowOffset;
        }
    }

    Result<void> finishStep(MeshChunk& chunk) {
        if (++step_ < steps_.size()) return {};
        step_ = 0;
        if (plan_.role == PlyRole::Vertices) VCP_TRY(decodeVertices(scalarRow_.data(), 1, chunk));
        ++row_;
        return {};
    }

    std::vector<Step> steps_;
    std::vector<uint64_t> scalarOffsets_;  // for each column: scalar bytes of the row before it
    uint64_t rowBytes_ = 0;                // scalars only
    bool fixedRows_ = false;

    std::optional<PlyType> positionType_;  // when x, y and z share it
    bool byteColours_ = false;
    std::vector<char> scalarRow_;
    std::array<uint64_t, 3> positionBytes_{};

    FaceLayout faceLayout_;
    TakeTriangles takeTriangles_ = nullptr;

    size_t step_ = 0;
    bool insideList_ = false;
    uint64_t listLeft_ = 0;
};

}  // namespace

std::unique_ptr<PlyRows> makePlyBinaryRows(ByteSource& source, const PlyPlan& plan, PlyEncoding encoding) {
    static_assert(std::endian::native == std::endian::little);
    if (encoding == PlyEncoding::BigEndian) return std::make_unique<BinaryRows<true>>(source, plan);
    return std::make_unique<BinaryRows<false>>(source, plan);
}

}  // namespace vcp
