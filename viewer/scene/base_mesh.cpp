#include "viewer/scene/base_mesh.h"

#include <charconv>
#include <cmath>
#include <string>

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include "builder/mesh/open_mesh.h"

namespace vcp {

namespace {

constexpr size_t kLongestLine = 1 << 20;
constexpr size_t kMostTriangles = 5'000'000;

Error noMap(const std::string& name, std::string element = {}) {
    return {.code = ErrorCode::InvalidInput,
            .message = "has no texture coordinates, which say where the mesostructure goes; unwrap the mesh first",
            .file = name,
            .element = std::move(element)};
}

Result<meso::BaseSurface> finished(meso::BaseSurface made, const std::string& name) {
    if (!(meso::tileEdge(made) > 0)) return noMap(name);
    meso::joinPositions(made);
    return made;
}

/// Reads the lines that define a base: v, vt, f. Other lines are skipped.
class ObjBase {
public:
    ObjBase(ByteSource source, double tiles) : source_(std::move(source)), tiles_(tiles) {}

    Result<meso::BaseSurface> read() {
        while (true) {
            ++line_;
            const auto line = source_.line(kLongestLine);
            if (!line)
                return line.error().code == ErrorCode::Limit ? wrong("the line is longer than 1 MiB") : line.error();
            if (!*line) break;
            text_ = (*line)->substr(0, (*line)->find('#'));
            const std::string_view word = nextWord();
            if (word == "v")
                VCP_TRY(readPosition());
            else if (word == "vt")
                VCP_TRY(readCoordinate());
            else if (word == "f")
                VCP_TRY(readFace());
            if (made_.positions.size() > 3 * kMostTriangles || coordinates_.size() > 3 * kMostTriangles)
                return wrong("a base surface has at most 15 million vertices and texture coordinates",
                             ErrorCode::Limit);
            if (made_.triangles.size() > kMostTriangles)
                return wrong("a base surface has at most 5 million triangles", ErrorCode::Limit);
        }
        if (made_.triangles.empty()) return source_.error(ErrorCode::InvalidInput, "", std::nullopt, "has no faces");
        return finished(std::move(made_), source_.name());
    }

private:
    Error wrong(std::string message, ErrorCode code = ErrorCode::InvalidInput) const {
        return source_.error(code, fmt::format("line {}", line_), std::nullopt, std::move(message));
    }
    std::string_view nextWord() {
        constexpr std::string_view kBlanks = " \t\r\v\f";
        text_.remove_prefix(std::min(text_.find_first_not_of(kBlanks), text_.size()));
        const std::string_view word = text_.substr(0, text_.find_first_of(kBlanks));
        text_.remove_prefix(word.size());
        return word;
    }
    bool nextReal(double& value) {
        const std::string_view word = nextWord();
        const auto [stop, failure] = fast_float::from_chars(word.data(), word.data() + word.size(), value);
        return failure == std::errc() && stop == word.data() + word.size() && std::isfinite(value);
    }
    Result<void> readPosition() {
        glm::dvec3 p;
        if (!nextReal(p.x) || !nextReal(p.y) || !nextReal(p.z)) return wrong("a vertex is three numbers");
        made_.positions.push_back(p);
        return {};
    }
    Result<void> readCoordinate() {
        glm::dvec2 uv;
        if (!nextReal(uv.x) || !nextReal(uv.y)) return wrong("texture coordinates are two numbers");
        coordinates_.push_back(uv * tiles_);
        return {};
    }
    /// Reads a number that counts from 1, or, below 0, from the end.
    template <class T>
    bool at(std::string_view word, const std::vector<T>& of, uint32_t& index) const {
        int64_t number = 0;
        const auto [stop, failure] = std::from_chars(word.data(), word.data() + word.size(), number);
        const auto count = int64_t(of.size());
        if (failure != std::errc() || stop != word.data() + word.size() || number == 0 || number > count ||
            number < -count)
            return false;
        index = uint32_t(number > 0 ? number - 1 : count + number);
        return true;
    }
    Result<void> readFace() {
        std::vector<std::pair<uint32_t, uint32_t>> corners;
        for (std::string_view word = nextWord(); !word.empty(); word = nextWord()) {
            const size_t slash = word.find('/');
            std::pair<uint32_t, uint32_t> corner;
            if (!at(word.substr(0, slash), made_.positions, corner.first))
                return wrong(fmt::format("\"{}\" names no vertex before it", word.substr(0, 40)));
            if (slash == std::string_view::npos || slash + 1 == word.size() || word[slash + 1] == '/')
                return noMap(source_.name(), fmt::format("line {}", line_));
            const std::string_view rest = word.substr(slash + 1);
            if (!at(rest.substr(0, rest.find('/')), coordinates_, corner.second))
                return wrong(fmt::format("\"{}\" names no texture coordinates before it", word.substr(0, 40)));
            corners.push_back(corner);
        }
        if (corners.size() < 3) return wrong("a face has three corners at least");
        for (size_t i = 2; i < corners.size(); ++i) {
            made_.triangles.push_back({corners[0].first, corners[i - 1].first, corners[i].first});
            made_.uvs.push_back({coordinates_[corners[0].second], coordinates_[corners[i - 1].second],
                                 coordinates_[corners[i].second]});
        }
        return {};
    }

    ByteSource source_;
    double tiles_;
    meso::BaseSurface made_;
    std::vector<glm::dvec2> coordinates_;
    std::string_view text_;
    uint64_t line_ = 0;
};

Result<meso::BaseSurface> readStream(const std::filesystem::path& path, double tiles) {
    VCP_TRY_ASSIGN(auto stream, openMesh(path));
    meso::BaseSurface made;
    for (MeshChunk chunk;;) {
        VCP_TRY_ASSIGN(const auto more, stream->next(chunk));
        if (!more) break;
        if (chunk.uvs.size() != chunk.triangles.size()) return noMap(path.string());
        made.positions.insert(made.positions.end(), chunk.positions.begin(), chunk.positions.end());
        for (size_t i = 0; i < chunk.triangles.size(); ++i) {
            const auto& t = chunk.triangles[i];
            made.triangles.push_back({uint32_t(t[0]), uint32_t(t[1]), uint32_t(t[2])});
            auto& map = made.uvs.emplace_back();
            // The stream's v grows downwards.
            for (int k = 0; k < 3; ++k) map[k] = glm::dvec2(chunk.uvs[i][k].x, 1 - chunk.uvs[i][k].y) * tiles;
        }
        if (made.triangles.size() > kMostTriangles || made.positions.size() > 3 * kMostTriangles)
            return Error{.code = ErrorCode::Limit,
                         .message = "a base surface has at most 5 million triangles",
                         .file = path.string()};
    }
    return finished(std::move(made), path.string());
}

}  // namespace

Result<meso::BaseSurface> readBaseObj(ByteSource source, double tiles) {
    return ObjBase(std::move(source), tiles).read();
}

Result<meso::BaseSurface> readBaseMesh(const std::filesystem::path& path, double tiles) {
    std::string extension = path.extension().string();
    for (char& letter : extension) letter = char(std::tolower(static_cast<unsigned char>(letter)));
    if (extension != ".obj") return readStream(path, tiles);
    VCP_TRY_ASSIGN(auto source, ByteSource::open(path));
    return readBaseObj(std::move(source), tiles);
}

}  // namespace vcp
