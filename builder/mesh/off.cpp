#include "builder/mesh/off.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "builder/mesh/off_header.h"
#include "builder/stream/chunk_room.h"
#include "builder/stream/number_text.h"

namespace vcp {
namespace {

constexpr size_t kElementLineLimit = 1024 * 1024;  // bytes; a face may have many vertices

// The state that the two encodings share: how far the stream is, and what is wrong.
class OffStream : public MeshStream {
public:
    OffStream(ByteSource source, const OffHeader& header) : source_(std::move(source)), header_(header) {
        info_.format = header.binary ? "OFF binary" : "OFF ASCII";
        info_.fileBytes = source_.fileBytes();
        info_.vertices = header.vertices;
        info_.faces = header.faces;
        info_.hasColour = header.hasColour;
    }

    [[nodiscard]] const MeshInfo& info() const override { return info_; }
    [[nodiscard]] uint64_t bytesRead() const override { return source_.fileBytesRead(); }
    [[nodiscard]] std::span<const std::string> warnings() const override { return warnings_; }

    Result<bool> next(MeshChunk& chunk) override {
        chunk.clear();
        while (hasRoom(chunk) && face_ < header_.faces) VCP_TRY(readSome(chunk));
        return !isEmpty(chunk);
    }

protected:
    virtual Result<void> readSome(MeshChunk& chunk) = 0;

    [[nodiscard]] bool inVertices() const { return vertex_ < header_.vertices; }

    Error wrong(uint64_t byte, std::string message) const {
        return source_.error(ErrorCode::InvalidInput,
                             inVertices() ? fmt::format("vertex {}", vertex_) : fmt::format("face {}", face_), byte,
                             std::move(message));
    }

    Error truncated() const {
        return wrong(source_.offset(),
                     fmt::format("the file ends here, but the header declares {} vertices and {} faces: it is "
                                 "truncated or the counts are wrong",
                                 header_.vertices, header_.faces));
    }

    /// `normal`: of any length, 0 where it is not known.
    Result<void> addVertex(const glm::dvec3& position, const glm::dvec3& normal, Rgba8 colour, uint64_t byte,
                           MeshChunk& chunk) {
        if (!std::isfinite(position.x) || !std::isfinite(position.y) || !std::isfinite(position.z))
            return wrong(byte, "the position is not finite (NaN or infinite)");
        chunk.positions.push_back(position);
        if (header_.hasNormal) chunk.normals.push_back(packDirection(normal));
        if (header_.hasColour) chunk.colours.push_back(colour);
        ++vertex_;
        return {};
    }

    // Takes the next number of the face at `corner`.
    Result<void> addCorner(uint64_t corner, int64_t number, uint64_t byte, MeshChunk& chunk) {
        if (number < 0 || uint64_t(number) >= header_.vertices)
            return wrong(
                byte, fmt::format("vertex number {} is out of range; the mesh has {} vertices, numbered from 0", number,
                                  header_.vertices));
        const auto vertex = uint64_t(number);
        if (corner == 0) first_ = vertex;
        if (corner > 1) chunk.triangles.push_back({first_, last_, vertex});
        last_ = vertex;
        return {};
    }

    void warnOfFaceColours() {
        if (warnings_.empty())
            warnings_.push_back(source_.name() + ": colours of faces are left out; use PLY with vertex colours");
    }

    ByteSource source_;
    OffHeader header_;
    MeshInfo info_;
    std::vector<std::string> warnings_;
    uint64_t vertex_ = 0;
    uint64_t face_ = 0;
    uint64_t first_ = 0;  // first vertex of the face's fan
    uint64_t last_ = 0;
};

class AsciiOff final : public OffStream {
public:
    using OffStream::OffStream;

private:
    static size_t afterLastLine(std::string_view text) { return text.rfind('\n') + 1; }

    Result<void> readSome(MeshChunk& chunk) override {
        VCP_TRY_ASSIGN(const auto text, source_.wholeWindow(afterLastLine, kElementLineLimit));
        if (text.empty()) return truncated();
        begin_ = text.data();
        const char* const end = begin_ + text.size();
        const char* p = begin_;
        while (p != end && hasRoom(chunk) && face_ < header_.faces) {
            const char* const stop = std::find(p, end, '\n');
            end_ = std::find(p, stop, '#');
            p = skipSpaces(p, end_);
            if (p != end_) VCP_TRY(inVertices() ? readVertex(p, chunk) : readFace(p, chunk));
            p = stop == end ? end : stop + 1;
        }
        source_.advance(uint64_t(p - begin_));
        return {};
    }

    uint64_t byteAt(const char* p) const { return source_.offset() + uint64_t(p - begin_); }

    bool endsWord(const char* p) const { return p && (p == end_ || isSpace(*p)); }

    Error notANumber(const char* p) const { return wrong(byteAt(p), shownWord(p, end_) + " is not a number"); }

    Result<void> readVertex(const char* p, MeshChunk& chunk) {
        const char* const line = p;
        const size_t before = header_.numbersBeforeColour();
        std::array<double, 10> numbers{};
        size_t count = 0;
        bool fractions = false;
        for (; p != end_ && count < before + (header_.hasColour ? 4 : 0); p = skipSpaces(p, end_)) {
            const char* const stop = parseReal(p, end_, numbers[count]);
            if (!endsWord(stop)) return notANumber(p);
            if (count >= before)
                fractions =
                    fractions || std::find_if(p, stop, [](char c) { return c == '.' || c == 'e' || c == 'E'; }) != stop;
            ++count;
            p = stop;
        }
        const size_t needed = header_.hasColour ? before + 3 : 3;
        if (count < needed)
            return wrong(byteAt(line), fmt::format("a vertex needs {} numbers, this one has {}", needed, count));
        Rgba8 colour = 0xFF000000;
        for (size_t channel = 0; header_.hasColour && before + channel < count; ++channel) {
            const double scaled = fractions ? numbers[before + channel] * 255 + 0.5 : numbers[before + channel];
            // std::clamp is not used: here the order of the comparisons makes NaN 0.
            const double value = std::min(std::max(0.0, scaled), 255.0);
            colour &= ~(0xFFu << (8 * channel));
            colour |= static_cast<Rgba8>(value) << (8 * channel);
        }
        const glm::dvec3 normal = count < 6 ? glm::dvec3(0) : glm::dvec3(numbers[3], numbers[4], numbers[5]);
        return addVertex({numbers[0], numbers[1], numbers[2]}, normal, colour, byteAt(line), chunk);
    }

    Result<void> readFace(const char* p, MeshChunk& chunk) {
        int64_t corners = 0;
        const char* const line = p;
        const char* stop = parseInteger(p, end_, corners);
        if (!endsWord(stop) || corners < 0) return wrong(byteAt(p), shownWord(p, end_) + " is not a count of corners");
        for (int64_t corner = 0; corner < corners; ++corner) {
            p = skipSpaces(stop, end_);
            if (p == end_)
                return wrong(byteAt(line),
                             fmt::format("a face of {} corners, but its line has only {}", corners, corner));
            int64_t number = 0;
            stop = parseInteger(p, end_, number);
            if (!endsWord(stop)) return wrong(byteAt(p), shownWord(p, end_) + " is not a vertex number");
            VCP_TRY(addCorner(uint64_t(corner), number, byteAt(p), chunk));
        }
        if (skipSpaces(stop, end_) != end_) warnOfFaceColours();
        ++face_;
        return {};
    }

    const char* begin_ = nullptr;  // start of the window, which starts at the cursor
    const char* end_ = nullptr;    // end of the line that is read
};

class BinaryOff final : public OffStream {
public:
    using OffStream::OffStream;

private:
    Result<void> readSome(MeshChunk& chunk) override { return inVertices() ? readVertices(chunk) : readFaces(chunk); }

    uint32_t load(const char* p) const {
        uint32_t value;
        std::memcpy(&value, p, sizeof value);
        return header_.bigEndian ? __builtin_bswap32(value) : value;
    }
    float loadReal(const char* p) const { return std::bit_cast<float>(load(p)); }

    Result<void> readVertices(MeshChunk& chunk) {
        const size_t rowBytes = 4 * header_.numbersOfVertex();
        VCP_TRY_ASSIGN(const auto bytes, source_.window(rowBytes));
        if (bytes.size() < rowBytes) return truncated();
        const char* p = bytes.data();
        const char* const end = p + bytes.size();
        for (; size_t(end - p) >= rowBytes && inVertices() && hasRoom(chunk); p += rowBytes) {
            Rgba8 colour = 0;
            const char* const rgba = p + 4 * header_.numbersBeforeColour();
            for (size_t channel = 0; header_.hasColour && channel < 4; ++channel) {
                const float value = std::min(std::max(0.0f, loadReal(rgba + 4 * channel)), 1.0f);
                colour |= static_cast<Rgba8>(value * 255 + 0.5f) << (8 * channel);
            }
            const glm::dvec3 normal =
                header_.hasNormal ? glm::dvec3(loadReal(p + 12), loadReal(p + 16), loadReal(p + 20)) : glm::dvec3(0);
            VCP_TRY(addVertex({loadReal(p), loadReal(p + 4), loadReal(p + 8)}, normal, colour,
                              source_.offset() + uint64_t(p - bytes.data()), chunk));
        }
        source_.advance(uint64_t(p - bytes.data()));
        return {};
    }

    // Faces are read number by number, since one may be larger than the window.
    Result<void> readFaces(MeshChunk& chunk) {
        VCP_TRY_ASSIGN(const auto bytes, source_.window(4));
        if (bytes.size() < 4) return truncated();
        const char* p = bytes.data();
        const char* const end = p + bytes.size();
        for (; end - p >= 4 && face_ < header_.faces && hasRoom(chunk); p += 4) {
            const uint64_t byte = source_.offset() + uint64_t(p - bytes.data());
            VCP_TRY(takeNumber(load(p), byte, chunk));
        }
        source_.advance(uint64_t(p - bytes.data()));
        return {};
    }

    enum class Part { Corners, Indices, ColourCount, Colour };

    Result<void> takeNumber(uint32_t number, uint64_t byte, MeshChunk& chunk) {
        switch (part_) {
            case Part::Corners:
                left_ = corners_ = number;
                part_ = left_ > 0 ? Part::Indices : Part::ColourCount;
                break;
            case Part::Indices:
                VCP_TRY(addCorner(corners_ - left_, int64_t{number}, byte, chunk));
                if (--left_ == 0) part_ = Part::ColourCount;
                break;
            case Part::ColourCount:
                if (number > 4)
                    return wrong(byte, fmt::format("a face colour of {} numbers; there are at most 4", number));
                if (number > 0) warnOfFaceColours();
                left_ = number;
                endColour();
                break;
            case Part::Colour:
                --left_;
                endColour();
                break;
        }
        return {};
    }

    void endColour() {
        part_ = left_ > 0 ? Part::Colour : Part::Corners;
        if (left_ == 0) ++face_;
    }

    Part part_ = Part::Corners;
    uint64_t corners_ = 0;
    uint64_t left_ = 0;  // numbers left in the part
};

}  // namespace

Result<std::unique_ptr<MeshStream>> openOff(ByteSource source) {
    VCP_TRY_ASSIGN(const auto header, readOffHeader(source));
    if (header.binary) return std::unique_ptr<MeshStream>(std::make_unique<BinaryOff>(std::move(source), header));
    return std::unique_ptr<MeshStream>(std::make_unique<AsciiOff>(std::move(source), header));
}

}  // namespace vcp
