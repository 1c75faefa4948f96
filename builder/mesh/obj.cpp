#include "builder/mesh/obj.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "builder/mesh/obj_materials.h"
#include "builder/stream/chunk_room.h"
#include "builder/stream/number_text.h"
#include "builder/stream/spilled_array.h"

namespace vcp {
namespace {

constexpr size_t kStatementLimit = 1024 * 1024;
constexpr size_t kColouredStartBytes = 256 * 1024;  // bytes that are searched for colours

// Returns the position after the last line end that no backslash precedes.
size_t afterLastStatement(std::string_view text) {
    while (true) {
        const size_t lineEnd = text.rfind('\n');
        if (lineEnd == std::string_view::npos) return 0;
        std::string_view line = text.substr(0, lineEnd);
        if (line.ends_with('\r')) line.remove_suffix(1);
        if (!line.ends_with('\\')) return lineEnd + 1;
        text = line;
    }
}

// The numbers of a `v` statement: at most x y z w r g b are of interest.
struct VertexNumbers {
    std::array<double, 7> values{};
    size_t count = 0;

    [[nodiscard]] bool hasColour() const { return count >= 6; }
    [[nodiscard]] const double* colour() const { return values.data() + (count == 6 ? 3 : 4); }
};

// Without materials where all coordinates are wanted.
MeshOpenOptions paintOf(MeshOpenOptions options) {
    options.materials = options.materials && options.coordinates == Coordinates::OfMaterials;
    return options;
}

class ObjStream final : public MeshStream {
public:
    ObjStream(ByteSource source, const std::filesystem::path& path, const MeshOpenOptions& options)
        : source_(std::move(source)),
          materials_(path, paintOf(options)),
          wanted_(options.coordinates),
          mostCoordinates_(options.mostCoordinates),
          normals_(options.tempFolder) {
        info_.format = "OBJ";
        info_.fileBytes = source_.fileBytes();
        // The shortest vertex is "v 0 0 0\n".
        mostVertices_ = source_.size() / 8 + 1;
    }

    // Skips a byte order mark and looks at the first vertices for colours.
    Result<void> begin() {
        VCP_TRY_ASSIGN(const auto text, source_.window(kUtf8Mark.size()));
        if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
            return source_.error(ErrorCode::Unsupported, "", 0, "is UTF-16 text; save it as UTF-8 or ASCII");
        if (text.starts_with(kUtf8Mark)) source_.advance(kUtf8Mark.size());
        VCP_TRY(lookForColours());
        materials_.begin();
        info_.hasMaterials = materials_.active();
        return {};
    }

    [[nodiscard]] const MeshInfo& info() const override { return info_; }
    [[nodiscard]] uint64_t bytesRead() const override { return source_.fileBytesRead(); }

    [[nodiscard]] std::span<const Material> materials() const override { return materials_.materials(); }
    [[nodiscard]] std::span<const std::string> warnings() const override { return materials_.warnings(); }
    [[nodiscard]] std::span<const SideFile> sideFiles() const override { return materials_.sideFiles(); }

    Result<bool> next(MeshChunk& chunk) override {
        chunk.clear();
        while (hasRoom(chunk)) {
            if (source_.atEnd()) {
                VCP_TRY(checkEnd());
                break;
            }
            VCP_TRY(openWindow());
            const char* p = begin_;
            while (p != end_ && hasRoom(chunk)) {
                statement_ = p;
                statementLine_ = line_;
                VCP_TRY(readStatement(p, chunk));
            }
            source_.advance(uint64_t(p - begin_));
        }
        return !isEmpty(chunk);
    }

private:
    Result<void> openWindow() {
        VCP_TRY_ASSIGN(const auto text, source_.wholeWindow(afterLastStatement, kStatementLimit));
        begin_ = text.data();
        end_ = begin_ + text.size();
        return {};
    }

    // Whole numbers 0..255 and fractions 0..1 are told apart by the start of the file alone, so that the answer
    // does not depend on where the stream stands.
    Result<void> lookForColours() {
        VCP_TRY_ASSIGN(auto start, source_.window(kColouredStartBytes));
        if (start.size() < source_.remaining()) start = start.substr(0, afterLastStatement(start));
        begin_ = start.data();
        end_ = begin_ + start.size();
        bool first = true;
        bool done = false;  // with the vertices
        for (const char* p = begin_; p != end_;) {
            const char* const word = skipBlanks(p, end_);
            if (const char* const names = afterKeyword(word, "mtllib"))
                materials_.addLibrary({names, size_t(lineEnd(names) - names)});
            if (!done && end_ - word >= 2 && word[0] == 'v' && isBlank(word[1])) {
                VertexNumbers numbers;
                const char* q = word + 1;
                done = !readNumbers(q, numbers);  // reported when it is read in earnest
                if (first && !done) info_.hasColour = numbers.hasColour();
                first = false;
                done = done || !info_.hasColour;
                if (!done && numbers.hasColour() && std::any_of(numbers.colour(), numbers.colour() + 3, isAboveOne)) {
                    colourScale_ = 1.0;
                    done = true;
                }
                p = q;
            }
            p = lineEnd(p);
            if (p != end_) ++p;
        }
        line_ = 1;
        lookedAtBytes_ = byteAt(end_);
        return {};
    }

    static bool isAboveOne(double value) { return value > 1.0; }

    const char* lineEnd(const char* p) const {
        const void* const found = std::memchr(p, '\n', size_t(end_ - p));
        return found ? static_cast<const char*>(found) : end_;
    }

    Error wrong(const char* p, std::string message) const {
        return source_.error(ErrorCode::InvalidInput, fmt::format("line {}", line_), byteAt(p), std::move(message));
    }

    uint64_t byteAt(const char* p) const { return source_.offset() + uint64_t(p - begin_); }

    // Takes one line, or several joined by backslashes, with its end.
    Result<void> readStatement(const char*& p, MeshChunk& chunk) {
        p = skipBlanks(p, end_);
        if (end_ - p >= 2 && p[0] == 'v' && isBlank(p[1])) {
            ++p;
            VCP_TRY(readVertex(p, chunk));
        } else if (end_ - p >= 2 && p[0] == 'f' && isBlank(p[1])) {
            ++p;
            VCP_TRY(readFace(p, chunk));
        } else if (const char* const n = afterKeyword(p, "vn")) {
            p = n;
            VCP_TRY(readNormal(p));
        } else if (materials_.active()) {
            VCP_TRY(readPaint(p));
        } else if (const char* const q = wantsAll() ? afterKeyword(p, "vt") : nullptr) {
            p = q;
            VCP_TRY(readCoordinates(p));
        }
        p = lineEnd(p);
        if (p != end_) {
            ++p;
            ++line_;
        }
        return {};
    }

    // Returns where the word `keyword` ends, or nullptr when another word stands at p.
    const char* afterKeyword(const char* p, std::string_view keyword) const {
        const auto left = size_t(end_ - p);
        if (left <= keyword.size() || std::string_view(p, keyword.size()) != keyword || !isBlank(p[keyword.size()]))
            return nullptr;
        return p + keyword.size();
    }

    // Reads `vt`, `usemtl`, and an `mtllib` that comes too late to count.
    Result<void> readPaint(const char*& p) {
        const char* const end = lineEnd(p);
        if (const char* const name = afterKeyword(p, "usemtl")) {
            materials_.use({name, size_t(end - name)});
        } else if (const char* const library = afterKeyword(p, "mtllib")) {
            if (byteAt(p) >= lookedAtBytes_) materials_.addLibrary({library, size_t(end - library)});
        } else if (const char* q = afterKeyword(p, "vt"); q && materials_.hasImages()) {
            VertexNumbers numbers;
            if (!readNumbers(q, numbers)) return wrong(q, shownWord(q, end_) + " is not a number");
            p = q;
            return materials_.addUv(numbers.values[0], numbers.values[1]);
        }
        return {};
    }

    Result<void> readNormal(const char*& p) {
        VertexNumbers numbers;
        if (!readNumbers(p, numbers)) return normals_.append(kUnknownNormal);
        return normals_.append(packDirection({numbers.values[0], numbers.values[1], numbers.values[2]}));
    }

    /// Adds the normals of the triangle that was just added.
    Result<void> addNormals(const std::array<std::optional<uint64_t>, 3>& numbers, MeshChunk& chunk) {
        if (normals_.size() == 0) return {};
        std::array<uint32_t, 3> normals{kUnknownNormal, kUnknownNormal, kUnknownNormal};
        // Those before the file's first normal have none.
        chunk.cornerNormals.resize(chunk.triangles.size() - 1, normals);
        for (size_t i = 0; i < 3; ++i) {
            if (!numbers[i]) continue;
            VCP_TRY_ASSIGN(normals[i], normals_.at(*numbers[i]));
        }
        chunk.cornerNormals.push_back(normals);
        return {};
    }

    bool wantsAll() const { return wanted_ != Coordinates::OfMaterials; }

    Result<void> readCoordinates(const char*& p) {
        const char* const start = p;
        VertexNumbers numbers;
        if (!readNumbers(p, numbers)) return wrong(p, shownWord(p, end_) + " is not a number");
        const glm::dvec2 uv(numbers.values[0], numbers.values[1]);
        if (numbers.count < 2 || !std::isfinite(uv.x) || !std::isfinite(uv.y))
            return wrong(start, "texture coordinates are two finite numbers");
        if (coordinates_.size() == mostCoordinates_)
            return source_.error(ErrorCode::Limit, fmt::format("line {}", line_), byteAt(start),
                                 fmt::format("has more than {} texture coordinates", mostCoordinates_));
        coordinates_.push_back(uv);
        return {};
    }

    Result<void> addCoordinates(const std::array<std::optional<uint64_t>, 3>& uvs, MeshChunk& chunk) const {
        if (uvs[0] && uvs[1] && uvs[2])
            chunk.coordinates.push_back({coordinates_[*uvs[0]], coordinates_[*uvs[1]], coordinates_[*uvs[2]]});
        else if (wanted_ == Coordinates::Required)
            return source_.error(ErrorCode::InvalidInput, fmt::format("line {}", line_), std::nullopt,
                                 "has no texture coordinates before it, which say where things go on the surface; "
                                 "unwrap the mesh first");
        return {};
    }

    // Moves to the next word of the statement, over line ends after a backslash. Returns false at the statement's end.
    bool toWord(const char*& p) {
        while (p != end_) {
            if (isBlank(*p)) {
                ++p;
            } else if (*p == '\\') {
                const char* q = p + 1;
                if (q != end_ && *q == '\r') ++q;
                if (q == end_ || *q != '\n') return true;
                p = q + 1;
                ++line_;
            } else {
                return *p != '\n' && *p != '#';
            }
        }
        return false;
    }

    // A word ends with white space, or with the backslash of a continued line.
    bool endsWord(const char* p) const { return p && (p == end_ || isSpace(*p) || *p == '\\'); }

    // Returns false when a word is not a number; `p` is left at it.
    bool readNumbers(const char*& p, VertexNumbers& numbers) {
        while (numbers.count < numbers.values.size() && toWord(p)) {
            const char* const stop = parseReal(p, end_, numbers.values[numbers.count]);
            if (!endsWord(stop)) return false;
            ++numbers.count;
            p = stop;
        }
        return true;
    }

    Result<void> readVertex(const char*& p, MeshChunk& chunk) {
        VertexNumbers numbers;
        if (!readNumbers(p, numbers)) return wrong(p, shownWord(p, end_) + " is not a number");
        if (numbers.count < 3)
            return wrong(p, fmt::format("a vertex needs 3 coordinates, this one has {}", numbers.count));
        const auto& [x, y, z, w, r, g, b] = numbers.values;
        if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z))
            return source_.error(ErrorCode::InvalidInput,
                                 fmt::format("line {}, vertex {}", statementLine_, vertices_ + 1), byteAt(statement_),
                                 "the position is not finite (NaN or infinite)");
        chunk.positions.emplace_back(x, y, z);
        if (info_.hasColour) chunk.colours.push_back(colourOf(numbers));
        ++vertices_;
        return {};
    }

    Rgba8 colourOf(const VertexNumbers& numbers) const {
        if (!numbers.hasColour()) return kWhite;
        const double* const rgb = numbers.colour();
        Rgba8 colour = 0xFF000000;
        for (int channel = 0; channel < 3; ++channel) {
            // std::clamp is not used: here the order of the comparisons makes NaN 0.
            const double value = std::min(std::max(0.0, rgb[channel] * colourScale_ + 0.5), 255.0);
            colour |= static_cast<Rgba8>(value) << (8 * channel);
        }
        return colour;
    }

    Result<void> readFace(const char*& p, MeshChunk& chunk) {
        ++faces_;
        uint64_t first = 0;
        uint64_t last = 0;
        // Numbers for the first corner, the last and this one.
        std::array<std::optional<uint64_t>, 3> uvs, normals;
        for (size_t corner = 0; toWord(p); ++corner) {
            uint64_t vertex = 0;
            VCP_TRY(readCorner(p, vertex, uvs[2], normals[2]));
            if (corner == 0) first = vertex;
            if (corner == 0) uvs[0] = uvs[2], normals[0] = normals[2];
            if (corner > 1) chunk.triangles.push_back({first, last, vertex});
            if (corner > 1) VCP_TRY(addNormals(normals, chunk));
            if (corner > 1 && materials_.active()) VCP_TRY(materials_.paint(uvs, chunk));
            if (corner > 1 && wantsAll()) VCP_TRY(addCoordinates(uvs, chunk));
            last = vertex;
            uvs[1] = uvs[2], normals[1] = normals[2];
        }
        return {};
    }

    // Reads v, v/t, v//n or v/t/n; t matters only for images.
    Result<void> readCorner(const char*& p, uint64_t& vertex, std::optional<uint64_t>& uv,
                            std::optional<uint64_t>& normal) {
        int64_t number = 0;
        const char* stop = parseInteger(p, end_, number);
        if (!stop || !(endsWord(stop) || *stop == '/'))
            return wrong(p, shownWord(p, end_) + " is not a corner of a face (v, v/t, v//n or v/t/n)");
        const auto seen = int64_t(vertices_);
        if (number == 0 || number < -seen || number > int64_t(mostVertices_)) return noSuchVertex(p, number);
        vertex = uint64_t(number > 0 ? number - 1 : seen + number);
        if (vertex >= vertices_ && vertex >= promised_) {
            promised_ = vertex + 1;
            promisedLine_ = line_;
            promisedByte_ = byteAt(p);
        }
        const bool isOfUse = materials_.hasImages() || wantsAll();
        const char* slash[2] = {nullptr, nullptr};
        for (int i = 0; !endsWord(stop); ++stop)
            if (*stop == '/' && i < 2) slash[i++] = stop;
        const uint64_t uvsSeen = wantsAll() ? coordinates_.size() : materials_.uvCount();
        uv = isOfUse && slash[0] ? numberAt(slash[0] + 1, uvsSeen) : std::nullopt;
        normal = slash[1] ? numberAt(slash[1] + 1, normals_.size()) : std::nullopt;
        p = stop;
        return {};
    }

    // Returns the number after a slash, from 0, of the `count` that came so far; nothing where there is none of these.
    std::optional<uint64_t> numberAt(const char* p, uint64_t count) const {
        int64_t number = 0;
        if (!parseInteger(p, end_, number)) return std::nullopt;
        const auto seen = int64_t(count);
        if (number == 0 || number < -seen || number > seen) return std::nullopt;
        return uint64_t(number > 0 ? number - 1 : seen + number);
    }

    Error noSuchVertex(const char* p, int64_t number) const {
        if (number == 0) return wrong(p, "a face names vertex 0; vertices are numbered from 1");
        if (number < 0)
            return wrong(p, fmt::format("a face names vertex {}, but only {} vertices precede it", number, vertices_));
        return wrong(p, fmt::format("a face names vertex {}, more than a file of this size can hold", number));
    }

    Result<void> checkEnd() const {
        if (faces_ == 0)
            return source_.error(ErrorCode::InvalidInput, "", std::nullopt,
                                 vertices_ ? "has no faces, only points or lines; reconstruct a surface first"
                                           : "has neither vertices nor faces");
        if (promised_ > vertices_)
            return source_.error(ErrorCode::InvalidInput, fmt::format("line {}", promisedLine_), promisedByte_,
                                 fmt::format("a face names vertex {}, but the file has only {}", promised_, vertices_));
        return {};
    }

    ByteSource source_;
    MeshInfo info_;
    ObjMaterials materials_;
    Coordinates wanted_;
    uint64_t mostCoordinates_;
    std::vector<glm::dvec2> coordinates_;  // when all are wanted
    SpilledArray<uint32_t> normals_;
    uint64_t lookedAtBytes_ = 0;  // the start of the file, where colours and materials are decided
    double colourScale_ = 255.0;  // from the file's colours to 0..255
    uint64_t mostVertices_ = 0;

    const char* begin_ = nullptr;  // start of the window, which starts at the cursor
    const char* end_ = nullptr;
    const char* statement_ = nullptr;
    uint64_t line_ = 1;
    uint64_t statementLine_ = 1;

    uint64_t vertices_ = 0;
    uint64_t faces_ = 0;
    uint64_t promised_ = 0;  // number of vertices that faces before them have named, so that must exist at the end
    uint64_t promisedLine_ = 0;
    uint64_t promisedByte_ = 0;
};

}  // namespace

bool looksLikeObj(std::string_view start) {
    static constexpr std::array<std::string_view, 10> kKeywords{"v", "vt", "vn", "vp",     "f",
                                                                "g", "o",  "s",  "mtllib", "usemtl"};
    if (start.starts_with(kUtf8Mark)) start.remove_prefix(kUtf8Mark.size());
    const char* const end = start.data() + start.size();
    for (const char* p = start.data(); (p = skipSpaces(p, end)) != end;) {
        if (*p != '#') {
            const char* const stop = wordEnd(p, end);
            return std::ranges::find(kKeywords, std::string_view(p, size_t(stop - p))) != kKeywords.end();
        }
        p = std::find(p, end, '\n');
    }
    return false;
}

Result<std::unique_ptr<MeshStream>> openObj(ByteSource source) { return openObj(std::move(source), {}, {}); }

Result<std::unique_ptr<MeshStream>> openObj(ByteSource source, const std::filesystem::path& path,
                                            const MeshOpenOptions& options) {
    auto stream = std::make_unique<ObjStream>(std::move(source), path, options);
    VCP_TRY(stream->begin());
    return std::unique_ptr<MeshStream>(std::move(stream));
}

}  // namespace vcp
