#include "viewer/base_mesh.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <string>

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include "builder/mesh_stream.h"

namespace vcp {

namespace {

constexpr size_t kLongestLine = 1 << 20;
constexpr size_t kMostTriangles = 5'000'000;

Error noMap(const std::filesystem::path& path, std::string element = {}) {
    return {.code = ErrorCode::InvalidInput,
            .message = "has no texture coordinates, which say where the mesostructure goes; unwrap the mesh first",
            .file = path.string(),
            .element = std::move(element)};
}

/// The lines that say what a base is: v, vt, f. Others are passed over.
class ObjBase {
public:
    ObjBase(const std::filesystem::path& path, double tiles) : path_(path), tiles_(tiles) {}

    Result<meso::BaseSurface> read() {
        std::ifstream file(path_, std::ios::binary);
        if (!file) return Error{.code = ErrorCode::Io, .message = "cannot be opened", .file = path_.string()};
        for (std::string line; std::getline(file, line);) {
            ++line_;
            if (line.size() > kLongestLine) return wrong("the line is longer than 1 MiB");
            if (made_.positions.size() > 3 * kMostTriangles || coordinates_.size() > 3 * kMostTriangles)
                return Error{.code = ErrorCode::Limit, .message = "a base surface has at most 15 million vertices and texture coordinates", .file = path_.string(), .element = fmt::format("line {}", line_)};
            text_ = line;
            const std::string_view word = nextWord();
            if (word == "v") VCP_TRY(readPosition());
            else if (word == "vt") VCP_TRY(readCoordinate());
            else if (word == "f") VCP_TRY(readFace());
        }
        if (file.bad()) return Error{.code = ErrorCode::Io, .message = "cannot be read", .file = path_.string()};
        if (made_.triangles.empty()) return wrong("has no faces", false);
        return std::move(made_);
    }

private:
    Error wrong(std::string message, bool hasLine = true) const {
        return {.code = ErrorCode::InvalidInput, .message = std::move(message), .file = path_.string(), .element = hasLine ? fmt::format("line {}", line_) : std::string()};
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
    /// A number from 1, or below 0 counted from the end.
    template <class T>
    bool at(std::string_view word, const std::vector<T>& of, uint32_t& index) const {
        int64_t number = 0;
        const auto [stop, failure] = std::from_chars(word.data(), word.data() + word.size(), number);
        const auto count = int64_t(of.size());
        if (failure != std::errc() || stop != word.data() + word.size() || number == 0 || number > count || number < -count) return false;
        index = uint32_t(number > 0 ? number - 1 : count + number);
        return true;
    }
    Result<void> readFace() {
        std::vector<std::pair<uint32_t, uint32_t>> corners;
        for (std::string_view word = nextWord(); !word.empty(); word = nextWord()) {
            const size_t slash = word.find('/');
            std::pair<uint32_t, uint32_t> corner;
            if (!at(word.substr(0, slash), made_.positions, corner.first)) return wrong(fmt::format("\"{}\" names no vertex before it", word.substr(0, 40)));
            if (slash == std::string_view::npos || slash + 1 == word.size() || word[slash + 1] == '/') return noMap(path_, fmt::format("line {}", line_));
            const std::string_view rest = word.substr(slash + 1);
            if (!at(rest.substr(0, rest.find('/')), coordinates_, corner.second)) return wrong(fmt::format("\"{}\" names no texture coordinates before it", word.substr(0, 40)));
            corners.push_back(corner);
        }
        if (corners.size() < 3) return wrong("a face has three corners at least");
        for (size_t i = 2; i < corners.size(); ++i) {
            made_.triangles.push_back({corners[0].first, corners[i - 1].first, corners[i].first});
            made_.uvs.push_back({coordinates_[corners[0].second], coordinates_[corners[i - 1].second], coordinates_[corners[i].second]});
        }
        if (made_.triangles.size() > kMostTriangles) return Error{.code = ErrorCode::Limit, .message = "a base surface has at most 5 million triangles", .file = path_.string()};
        return {};
    }

    std::filesystem::path path_;
    double tiles_;
    meso::BaseSurface made_;
    std::vector<glm::dvec2> coordinates_;
    std::string_view text_;
    uint64_t line_ = 0;
};

Result<meso::BaseSurface> readStream(const std::filesystem::path& path, double tiles) {
    auto stream = openMesh(path);
    if (!stream) return stream.error();
    meso::BaseSurface made;
    for (MeshChunk chunk;;) {
        const auto more = (*stream)->next(chunk);
        if (!more) return more.error();
        if (!*more) break;
        if (chunk.uvs.size() != chunk.triangles.size()) return noMap(path);
        made.positions.insert(made.positions.end(), chunk.positions.begin(), chunk.positions.end());
        for (size_t i = 0; i < chunk.triangles.size(); ++i) {
            const auto& t = chunk.triangles[i];
            made.triangles.push_back({uint32_t(t[0]), uint32_t(t[1]), uint32_t(t[2])});
            auto& map = made.uvs.emplace_back();
            // The stream's v grows downwards.
            for (int k = 0; k < 3; ++k) map[k] = glm::dvec2(chunk.uvs[i][k].x, 1 - chunk.uvs[i][k].y) * tiles;
        }
        if (made.triangles.size() > kMostTriangles || made.positions.size() > 3 * kMostTriangles)
            return Error{.code = ErrorCode::Limit, .message = "a base surface has at most 5 million triangles", .file = path.string()};
    }
    return made;
}

}  // namespace

Result<meso::BaseSurface> readBaseMesh(const std::filesystem::path& path, double tiles) {
    std::string extension = path.extension().string();
    for (char& letter : extension) letter = char(std::tolower(static_cast<unsigned char>(letter)));
    auto made = extension == ".obj" ? ObjBase(path, tiles).read() : readStream(path, tiles);
    if (!made) return made;
    if (!(meso::tileEdge(*made) > 0)) return noMap(path);
    meso::joinPositions(*made);
    return made;
}

}  // namespace vcp
