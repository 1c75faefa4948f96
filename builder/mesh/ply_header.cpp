#include "builder/mesh/ply_header.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include <fmt/format.h>

#include "builder/stream/number_text.h"

namespace vcp {
namespace {

constexpr size_t kHeaderLimit = 1024 * 1024;
constexpr size_t kElementLimit = 1024;
constexpr size_t kLongestFirstLine = 64;

std::optional<PlyType> typeOf(std::string_view word) {
    using enum PlyType;
    static constexpr std::array<std::pair<std::string_view, PlyType>, 16> kSpellings{{
        {"char", Int8},
        {"int8", Int8},
        {"uchar", Uint8},
        {"uint8", Uint8},
        {"short", Int16},
        {"int16", Int16},
        {"ushort", Uint16},
        {"uint16", Uint16},
        {"int", Int32},
        {"int32", Int32},
        {"uint", Uint32},
        {"uint32", Uint32},
        {"float", Float32},
        {"float32", Float32},
        {"double", Float64},
        {"float64", Float64},
    }};
    for (const auto& [spelling, type] : kSpellings)
        if (spelling == word) return type;
    return std::nullopt;
}

std::vector<std::string_view> wordsOf(std::string_view line) {
    std::vector<std::string_view> words;
    const char* const end = line.data() + line.size();
    for (const char* p = skipSpaces(line.data(), end); p != end;) {
        const char* const stop = wordEnd(p, end);
        words.emplace_back(p, size_t(stop - p));
        p = skipSpaces(stop, end);
    }
    return words;
}

// Reads the header line by line; `line` and `byte` say where it is.
class PlyHeaderReader {
public:
    explicit PlyHeaderReader(ByteSource& source) : source_(source) {}

    Result<PlyHeader> read() {
        VCP_TRY(findLineBreak());
        while (true) {
            VCP_TRY_ASSIGN(auto more, nextLine());
            if (!more) return wrong("the file ends inside the header; it is truncated");
            if (words_.empty() || words_[0] == "comment" || words_[0] == "obj_info") continue;
            if (words_[0] == "end_header") break;
            VCP_TRY(readStatement());
        }
        if (!formatSeen_) return wrong("the header has no 'format' line");
        return std::move(header_);
    }

private:
    Error wrong(std::string message) const {
        return source_.error(ErrorCode::InvalidInput, fmt::format("header line {}", lineNumber_), lineByte_,
                             std::move(message));
    }

    // Reads "ply" and the kind of line break that follows it: a lone CR must not swallow a body byte 0x0A.
    Result<void> findLineBreak() {
        VCP_TRY_ASSIGN(const auto start, source_.window(kLongestFirstLine));
        std::string_view text = start;
        if (!text.starts_with("ply")) return wrong("does not start with 'ply'; this is not a PLY file");
        text.remove_prefix(3);
        const size_t blanks = std::min(text.find_first_not_of(" \t"), text.size());
        text.remove_prefix(blanks);
        const size_t breakBytes = text.starts_with("\r\n") ? 2 : 1;
        if (!text.starts_with('\n') && !text.starts_with('\r')) return wrong("'ply' must stand on a line of its own");
        lineBreak_ = text[breakBytes - 1];
        source_.advance(3 + blanks + breakBytes);
        return {};
    }

    // Splits the next line into words_; returns false at the end of the file.
    Result<bool> nextLine() {
        ++lineNumber_;
        lineByte_ = source_.offset();
        if (source_.atEnd()) return false;
        const auto breakBefore = lineBreak_ == '\n' ? [](std::string_view text) { return text.rfind('\n') + 1; }
                                                    : [](std::string_view text) { return text.rfind('\r') + 1; };
        VCP_TRY_ASSIGN(const auto text, source_.wholeWindow(breakBefore, kHeaderLimit));
        const size_t length = text.find(lineBreak_);
        if (length == std::string_view::npos || source_.offset() + length > kHeaderLimit) {
            if (source_.size() > kHeaderLimit)
                return source_.error(ErrorCode::Limit, fmt::format("header line {}", lineNumber_), lineByte_,
                                     fmt::format("the header is longer than {} bytes", kHeaderLimit));
            return wrong("the file ends inside the header; it is truncated");
        }
        words_ = wordsOf(text.substr(0, length));
        source_.advance(length + 1);
        return true;
    }

    Result<void> readStatement() {
        if (words_[0] == "format") return readFormat();
        if (words_[0] == "element") return readElement();
        if (words_[0] == "property") return readProperty();
        return wrong(fmt::format("{} is not a PLY header keyword", shown(words_[0])));
    }

    Result<void> readFormat() {
        using enum PlyEncoding;
        if (formatSeen_) return wrong("a second 'format' line");
        if (words_.size() < 3 || words_[2] != "1.0") return wrong("expected 'format ENCODING 1.0'");
        if (words_[1] == "ascii")
            header_.encoding = Ascii;
        else if (words_[1] == "binary_little_endian")
            header_.encoding = LittleEndian;
        else if (words_[1] == "binary_big_endian")
            header_.encoding = BigEndian;
        else
            return wrong(fmt::format("unknown encoding {}", shown(words_[1])));
        formatSeen_ = true;
        return {};
    }

    Result<void> readElement() {
        if (words_.size() != 3) return wrong("expected 'element NAME COUNT'");
        if (header_.elements.size() == kElementLimit)
            return source_.error(ErrorCode::Limit, fmt::format("header line {}", lineNumber_), lineByte_,
                                 fmt::format("more than {} elements", kElementLimit));
        PlyElement element;
        element.name = words_[1];
        element.headerByte = lineByte_;
        const char* const end = words_[2].data() + words_[2].size();
        const auto [stop, failure] = std::from_chars(words_[2].data(), end, element.count);
        if (failure != std::errc() || stop != end)
            return wrong(fmt::format("{} is not a count of elements", shown(words_[2])));
        if (header_.find(element.name)) return wrong(fmt::format("a second element {}", shown(element.name)));
        header_.elements.push_back(std::move(element));
        return {};
    }

    Result<void> readProperty() {
        if (header_.elements.empty()) return wrong("a property before the first element");
        const bool list = words_.size() > 1 && words_[1] == "list";
        if (words_.size() != (list ? 5 : 3))
            return wrong(list ? "expected 'property list COUNT_TYPE TYPE NAME'" : "expected 'property TYPE NAME'");
        PlyProperty property;
        property.name = words_.back();
        const auto type = typeOf(words_[words_.size() - 2]);
        if (!type) return wrong(fmt::format("unknown type {}", shown(words_[words_.size() - 2])));
        property.type = *type;
        if (list) {
            property.countType = typeOf(words_[2]);
            if (!property.countType) return wrong(fmt::format("unknown type {}", shown(words_[2])));
        }
        header_.elements.back().properties.push_back(std::move(property));
        return {};
    }

    ByteSource& source_;
    PlyHeader header_;
    std::vector<std::string_view> words_;  // words of the current line; valid until the next
    char lineBreak_ = '\n';
    bool formatSeen_ = false;
    uint64_t lineNumber_ = 1;
    uint64_t lineByte_ = 0;
};

}  // namespace

bool PlyElement::hasLists() const { return std::ranges::any_of(properties, &PlyProperty::isList); }

uint64_t PlyElement::scalarBytes() const {
    uint64_t bytes = 0;
    for (const PlyProperty& property : properties)
        if (!property.isList()) bytes += byteSize(property.type);
    return bytes;
}

uint64_t PlyElement::leastBytes(PlyEncoding encoding) const {
    if (encoding == PlyEncoding::Ascii) return 2 * properties.size();
    uint64_t bytes = scalarBytes();
    for (const PlyProperty& property : properties)
        if (property.isList()) bytes += byteSize(*property.countType);
    return bytes;
}

const PlyProperty* PlyElement::find(std::string_view property) const {
    const auto found = std::ranges::find(properties, property, &PlyProperty::name);
    return found == properties.end() ? nullptr : &*found;
}

const PlyElement* PlyHeader::find(std::string_view element) const {
    const auto found = std::ranges::find(elements, element, &PlyElement::name);
    return found == elements.end() ? nullptr : &*found;
}

Result<PlyHeader> readPlyHeader(ByteSource& source) { return PlyHeaderReader(source).read(); }

}  // namespace vcp
