#include "builder/mesh/off_header.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "builder/mesh/off.h"
#include "builder/stream/number_text.h"

namespace vcp {
namespace {

std::string_view withoutComment(std::string_view line) { return line.substr(0, line.find('#')); }

std::string_view firstWord(std::string_view text) {
    const char* const end = text.data() + text.size();
    const char* const begin = skipSpaces(text.data(), end);
    return {begin, size_t(wordEnd(begin, end) - begin)};
}

// Returns the bytes of the keyword at the start of `word`; 0 when there is none.
size_t keywordBytes(std::string_view word, OffHeader& header, bool& otherDimension) {
    std::string_view rest = word;
    const auto take = [&](std::string_view prefix) {
        const bool there = rest.starts_with(prefix);
        if (there) rest.remove_prefix(prefix.size());
        return there;
    };
    header.hasTexture = take("ST");
    header.hasColour = take("C");
    header.hasNormal = take("N");
    otherDimension = take("4");
    otherDimension = take("n") || otherDimension;
    return take("OFF") ? word.size() - rest.size() : 0;
}

class OffHeaderReader {
public:
    explicit OffHeaderReader(ByteSource& source) : source_(source) {}

    Result<OffHeader> read() {
        VCP_TRY(nextLine());
        if (line_.starts_with(kUtf8Mark)) line_.remove_prefix(kUtf8Mark.size());
        const std::string_view word = firstWord(line_);
        bool otherDimension = false;
        OffHeader keyword;
        const size_t bytes = keywordBytes(word, keyword, otherDimension);
        if (otherDimension && bytes > 0)
            return source_.error(ErrorCode::Unsupported, "header", lineByte_,
                                 "4OFF and nOFF have no surface in three dimensions");
        if (bytes > 0) {
            header_ = keyword;
            line_.remove_prefix(size_t(word.data() - line_.data()) + bytes);
            header_.binary = firstWord(line_) == "BINARY";
            if (header_.binary) return readBinaryCounts();
        }
        return readCounts();
    }

private:
    Error wrong(std::string message) const {
        return source_.error(ErrorCode::InvalidInput, "header", lineByte_, std::move(message));
    }

    // Goes to the next line that has more than a comment.
    Result<void> nextLine() {
        do {
            lineByte_ = source_.offset();
            VCP_TRY_ASSIGN(const auto line, source_.line(kLineLimit));
            if (!line) return wrong("the file ends inside the header");
            line_ = withoutComment(*line);
        } while (firstWord(line_).empty());
        return {};
    }

    Result<OffHeader> readCounts() {
        if (firstWord(line_).empty()) VCP_TRY(nextLine());
        std::array<int64_t, 2> counts{};
        const char* const end = line_.data() + line_.size();
        const char* p = line_.data();
        for (int64_t& count : counts) {
            p = skipSpaces(p, end);
            if (p == end) return wrong("expected the counts of vertices, faces and edges");
            const char* const stop = parseInteger(p, end, count);
            if (!stop || (stop != end && !isSpace(*stop)) || count < 0)
                return wrong(fmt::format("{} is not a count of vertices or faces", shownWord(p, end)));
            p = stop;
        }
        header_.vertices = uint64_t(counts[0]);
        header_.faces = uint64_t(counts[1]);
        return checked(6, 2);  // "0 0 0\n" and "0\n"
    }

    Result<OffHeader> readBinaryCounts() {
        lineByte_ = source_.offset();
        VCP_TRY_ASSIGN(const auto bytes, source_.window(12));
        if (bytes.size() < 12) return wrong("the file ends inside the header");
        const auto number = [&](size_t at, bool bigEndian) {
            uint32_t value;
            std::memcpy(&value, bytes.data() + at, sizeof value);
            return bigEndian ? __builtin_bswap32(value) : value;
        };
        header_.bigEndian = number(0, true) <= number(0, false);
        header_.vertices = number(0, header_.bigEndian);
        header_.faces = number(4, header_.bigEndian);
        source_.advance(12);
        return checked(4 * header_.numbersOfVertex(), 4);
    }

    Result<OffHeader> checked(uint64_t leastVertex, uint64_t leastFace) const {
        if (header_.vertices == 0) return wrong("has no vertices");
        if (header_.faces == 0) return wrong("has no faces, only points or lines; reconstruct a surface first");
        const uint64_t left = source_.remaining() + 1;  // the last line may lack its end
        if (header_.vertices > left / leastVertex ||
            header_.faces > (left - header_.vertices * leastVertex) / leastFace)
            return wrong(
                fmt::format("declares {} vertices and {} faces, more than the file can hold: it is truncated "
                            "or the counts are wrong",
                            header_.vertices, header_.faces));
        return header_;
    }

    ByteSource& source_;
    OffHeader header_;
    std::string_view line_;  // valid until the next line
    uint64_t lineByte_ = 0;
};

}  // namespace

bool looksLikeOff(std::string_view start) {
    if (start.starts_with(kUtf8Mark)) start.remove_prefix(kUtf8Mark.size());
    while (!start.empty()) {
        const size_t lineBytes = std::min(start.find('\n'), start.size() - 1) + 1;
        const std::string_view word = firstWord(withoutComment(start.substr(0, lineBytes)));
        OffHeader header;
        bool otherDimension = false;
        if (!word.empty()) return keywordBytes(word, header, otherDimension) > 0;
        start.remove_prefix(lineBytes);
    }
    return false;
}

Result<OffHeader> readOffHeader(ByteSource& source) { return OffHeaderReader(source).read(); }

}  // namespace vcp
