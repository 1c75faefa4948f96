#include "builder/mesh/stl.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "builder/stream/chunk_room.h"
#include "builder/stream/number_text.h"

namespace vcp {
namespace {

constexpr size_t kStartBytes = 1024;
constexpr size_t kHeaderBytes = 84;  // text, then the count
constexpr size_t kFacetBytes = 50;   // normal, three vertices, attributes
constexpr size_t kNormalBytes = 12;
constexpr uint64_t kMostFacets = 0xffffffff;

static_assert(std::endian::native == std::endian::little, "STL is little endian");

bool isFinite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// Compares with `keyword`, which is in lower case.
bool sameWord(std::string_view word, std::string_view keyword) {
    if (word.size() != keyword.size()) return false;
    for (size_t i = 0; i < word.size(); ++i) {
        const char c = word[i] >= 'A' && word[i] <= 'Z' ? char(word[i] - 'A' + 'a') : word[i];
        if (c != keyword[i]) return false;
    }
    return true;
}

std::string_view wordAt(const char* p, const char* end) { return {p, size_t(wordEnd(p, end) - p)}; }

uint32_t facetCount(std::string_view start) {
    uint32_t count = 0;
    std::memcpy(&count, start.data() + kHeaderBytes - sizeof count, sizeof count);
    return count;
}

// Whether a text begins with "solid" and has only bytes of text; "facet" or "endsolid" must follow the name.
bool looksLikeAscii(std::string_view start) {
    const char* const end = start.data() + start.size();
    const char* p = skipSpaces(start.data(), end);
    if (!sameWord(wordAt(p, end), "solid")) return false;
    if (start.find('\0') != std::string_view::npos) return false;
    p = std::find(p, end, '\n');
    if (p == end) p = start.data();  // a solid on one line
    for (p = skipSpaces(p, end); p != end; p = skipSpaces(wordEnd(p, end), end)) {
        const std::string_view word = wordAt(p, end);
        if (sameWord(word, "facet") || sameWord(word, "endsolid")) return true;
    }
    return false;
}

// For binary STL whose length is not known: whether the whole facets at hand are finite, with normals of length 1 or 0.
bool facetsArePlausible(std::string_view start) {
    size_t facets = 0;
    for (size_t at = kHeaderBytes; at + kFacetBytes <= start.size(); at += kFacetBytes, ++facets) {
        float v[12];
        std::memcpy(v, start.data() + at, sizeof v);
        if (!std::all_of(v, v + 12, [](float value) { return std::isfinite(value); })) return false;
        const double squared = double(v[0]) * v[0] + double(v[1]) * v[1] + double(v[2]) * v[2];
        if (squared != 0 && std::abs(squared - 1) > 0.02) return false;
    }
    return facets > 0;
}

class BinaryStl final : public MeshStream {
public:
    explicit BinaryStl(ByteSource source) : source_(std::move(source)) {}

    Result<void> begin() {
        VCP_TRY_ASSIGN(const auto start, source_.window(kHeaderBytes));
        if (start.size() < kHeaderBytes)
            return source_.error(ErrorCode::InvalidInput, "header", source_.size(),
                                 fmt::format("the file ends inside the STL header of {} bytes", kHeaderBytes));
        facets_ = facetCount(start);
        source_.advance(kHeaderBytes);
        if (facets_ == 0)
            return source_.error(ErrorCode::InvalidInput, "header", kHeaderBytes - sizeof(uint32_t), "has no facets");
        const uint64_t whole = source_.remaining() / kFacetBytes;
        if (whole < facets_) return endsAfter(whole);
        if (source_.sizeKnown() && whole > kMostFacets)
            return source_.error(ErrorCode::Limit, "header", kHeaderBytes - sizeof(uint32_t),
                                 fmt::format("the file has room for {} facets, more than the 32 bits of an STL's count "
                                             "can say; convert the mesh to PLY, or part it",
                                             whole));
        info_.format = "STL binary";
        info_.fileBytes = source_.fileBytes();
        info_.vertices = 3 * facets_;
        info_.faces = facets_;
        return {};
    }

    [[nodiscard]] const MeshInfo& info() const override { return info_; }
    [[nodiscard]] uint64_t bytesRead() const override { return source_.fileBytesRead(); }

    Result<bool> next(MeshChunk& chunk) override {
        chunk.clear();
        while (hasRoom(chunk) && facet_ < facets_) {
            VCP_TRY_ASSIGN(const auto bytes, source_.window(kFacetBytes));
            const uint64_t room = (kChunkElements - chunk.positions.size() + 2) / 3;
            const auto facets = size_t(std::min({room, facets_ - facet_, uint64_t{bytes.size() / kFacetBytes}}));
            if (facets == 0) return endsAfter(facet_);
            VCP_TRY(decode(bytes.data(), facets, chunk));
            source_.advance(facets * kFacetBytes);
        }
        return !isEmpty(chunk);
    }

private:
    Error endsAfter(uint64_t facet) const {
        return source_.error(ErrorCode::InvalidInput, fmt::format("facet {}", facet),
                             kHeaderBytes + facet * kFacetBytes,
                             fmt::format("the header declares {} facets, but the file ends after {}: it is "
                                         "truncated, the count is wrong, or it is not STL",
                                         facets_, facet));
    }

    Result<void> decode(const char* p, size_t facets, MeshChunk& chunk) {
        const size_t before = chunk.positions.size();
        chunk.positions.resize(before + 3 * facets);
        glm::dvec3* out = chunk.positions.data() + before;
        for (size_t i = 0; i < facets; ++i, p += kFacetBytes, out += 3) {
            float v[9];
            std::memcpy(v, p + kNormalBytes, sizeof v);
            for (int corner = 0; corner < 3; ++corner) {
                out[corner] = {v[3 * corner], v[3 * corner + 1], v[3 * corner + 2]};
                if (!isFinite(out[corner])) return notFinite(i, corner);
            }
            const uint64_t first = 3 * facet_;
            chunk.triangles.push_back({first, first + 1, first + 2});
            ++facet_;
        }
        return {};
    }

    Error notFinite(size_t facetInWindow, int corner) const {
        const uint64_t byte = source_.offset() + facetInWindow * kFacetBytes + kNormalBytes + uint64_t(corner) * 12;
        return source_.error(ErrorCode::InvalidInput, fmt::format("facet {}, vertex {}", facet_, corner), byte,
                             "the position is not finite (NaN or infinite)");
    }

    ByteSource source_;
    MeshInfo info_;
    uint64_t facets_ = 0;
    uint64_t facet_ = 0;  // number of the next facet
};

// Where the text stands, after a word has been taken.
enum class Place { OutsideSolid, InSolid, InFacet, InLoop, AfterLoop };

class AsciiStl final : public MeshStream {
public:
    explicit AsciiStl(ByteSource source) : source_(std::move(source)) {
        info_.format = "STL ASCII";
        info_.fileBytes = source_.fileBytes();
    }

    [[nodiscard]] const MeshInfo& info() const override { return info_; }
    [[nodiscard]] uint64_t bytesRead() const override { return source_.fileBytesRead(); }

    Result<bool> next(MeshChunk& chunk) override {
        chunk.clear();
        while (hasRoom(chunk)) {
            VCP_TRY_ASSIGN(const auto text, source_.wholeWindow(afterLastLine, kLineLimit));
            begin_ = text.data();
            end_ = begin_ + text.size();
            const char* p = skipSpaces(begin_, end_);
            while (p != end_ && hasRoom(chunk)) {
                VCP_TRY(takeWord(p, chunk));
                p = skipSpaces(p, end_);
            }
            source_.advance(uint64_t(p - begin_));
            if (source_.atEnd()) {
                VCP_TRY(checkEnd());
                break;
            }
        }
        return !isEmpty(chunk);
    }

private:
    static size_t afterLastLine(std::string_view text) { return text.rfind('\n') + 1; }

    uint64_t byteAt(const char* p) const { return source_.offset() + uint64_t(p - begin_); }

    Error wrong(uint64_t byte, std::string message) const {
        return source_.error(ErrorCode::InvalidInput, fmt::format("facet {}", facets_), byte, std::move(message));
    }

    Error unexpected(const char* p, std::string_view expected) const {
        return wrong(byteAt(p), fmt::format("expected '{}', found {}", expected, shownWord(p, end_)));
    }

    // Takes a keyword with what belongs to it on its line.
    Result<void> takeWord(const char*& p, MeshChunk& chunk) {
        switch (place_) {
            case Place::OutsideSolid:
                return takeSolid(p);
            case Place::InSolid:
                return takeFacet(p);
            case Place::InFacet:
                return takeLoop(p);
            case Place::InLoop:
                return takeVertex(p, chunk);
            case Place::AfterLoop:
                return takeFacetEnd(p);
        }
        return {};
    }

    bool take(const char*& p, std::string_view keyword) const {
        const std::string_view word = wordAt(p, end_);
        if (!sameWord(word, keyword)) return false;
        p += word.size();
        return true;
    }

    // A solid's name ends with the line.
    void skipName(const char*& p) const { p = std::find(p, end_, '\n'); }

    Result<void> takeSolid(const char*& p) {
        if (!take(p, "solid")) return unexpected(p, "solid");
        skipName(p);
        place_ = Place::InSolid;
        return {};
    }

    Result<void> takeFacet(const char*& p) {
        if (take(p, "endsolid")) {
            skipName(p);
            place_ = Place::OutsideSolid;
            return {};
        }
        if (!take(p, "facet")) return unexpected(p, "facet");
        facetByte_ = byteAt(p) - 5;
        corners_ = 0;
        place_ = Place::InFacet;
        return {};
    }

    // The normal is not used: whatever stands before the loop is skipped.
    Result<void> takeLoop(const char*& p) {
        if (take(p, "outer")) return {};
        if (take(p, "loop")) {
            place_ = Place::InLoop;
            return {};
        }
        for (const std::string_view keyword : {"vertex", "endloop", "endfacet", "endsolid", "facet", "solid"})
            if (sameWord(wordAt(p, end_), keyword)) return unexpected(p, "outer loop");
        p = wordEnd(p, end_);
        return {};
    }

    Result<void> takeVertex(const char*& p, MeshChunk& chunk) {
        if (axis_ == 0 && corners_ == 3) {
            if (!take(p, "endloop")) return unexpected(p, "endloop");
            place_ = Place::AfterLoop;
            return {};
        }
        if (!inVertex_) {
            if (!take(p, "vertex")) return unexpected(p, "vertex");
            inVertex_ = true;
            return {};
        }
        double value = 0;
        const char* const stop = parseReal(p, end_, value);
        if (!stop || (stop != end_ && !isSpace(*stop)))
            return wrong(byteAt(p), shownWord(p, end_) + " is not a number");
        if (!std::isfinite(value))
            return source_.error(ErrorCode::InvalidInput, fmt::format("facet {}, vertex {}", facets_, corners_),
                                 byteAt(p), "the position is not finite (NaN or infinite)");
        corner_[corners_][int(axis_)] = value;
        p = stop;
        if (++axis_ == 3) {
            axis_ = 0;
            inVertex_ = false;
            if (++corners_ == 3) emit(chunk);
        }
        return {};
    }

    void emit(MeshChunk& chunk) const {
        const uint64_t first = 3 * facets_;
        chunk.positions.insert(chunk.positions.end(), corner_.begin(), corner_.end());
        chunk.triangles.push_back({first, first + 1, first + 2});
    }

    Result<void> takeFacetEnd(const char*& p) {
        if (!take(p, "endfacet")) return unexpected(p, "endfacet");
        ++facets_;
        place_ = Place::InSolid;
        return {};
    }

    Result<void> checkEnd() const {
        const bool betweenFacets = place_ == Place::OutsideSolid || place_ == Place::InSolid;
        if (!betweenFacets)
            return wrong(source_.size(), fmt::format("the file ends inside the facet that begins at byte {}; it is "
                                                     "truncated",
                                                     facetByte_));
        if (facets_ == 0) return source_.error(ErrorCode::InvalidInput, "", std::nullopt, "has no facets");
        return {};
    }

    ByteSource source_;
    MeshInfo info_;
    const char* begin_ = nullptr;  // start of the window, which starts at the cursor
    const char* end_ = nullptr;

    Place place_ = Place::OutsideSolid;
    uint64_t facets_ = 0;  // complete facets
    uint64_t facetByte_ = 0;
    bool inVertex_ = false;
    size_t axis_ = 0;     // numbers of the vertex that were read so far
    size_t corners_ = 0;  // vertices of the facet that were read so far
    std::array<glm::dvec3, 3> corner_{};
};

}  // namespace

bool looksLikeStl(std::string_view start, std::optional<uint64_t> fileBytes) {
    if (looksLikeAscii(start)) return true;
    if (start.size() < kHeaderBytes || facetCount(start) == 0) return false;
    if (fileBytes) return *fileBytes == kHeaderBytes + uint64_t{facetCount(start)} * kFacetBytes;
    return facetsArePlausible(start);
}

Result<std::unique_ptr<MeshStream>> openStl(ByteSource source) {
    VCP_TRY_ASSIGN(const auto window, source.window(kStartBytes));
    const std::string_view start = window.substr(0, kStartBytes);
    const uint64_t exactBytes =
        start.size() < kHeaderBytes ? 0 : kHeaderBytes + uint64_t{facetCount(start)} * kFacetBytes;
    // For a short or garbled text, the error of the text reader is the most useful.
    const bool isText =
        start.size() < kHeaderBytes && sameWord(wordAt(start.data(), start.data() + start.size()), "solid");
    if (source.size() != exactBytes && (isText || looksLikeAscii(start)))
        return std::unique_ptr<MeshStream>(std::make_unique<AsciiStl>(std::move(source)));
    auto stream = std::make_unique<BinaryStl>(std::move(source));
    VCP_TRY(stream->begin());
    return std::unique_ptr<MeshStream>(std::move(stream));
}

}  // namespace vcp
