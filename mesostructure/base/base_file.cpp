#include "mesostructure/base/base_file.h"

#include <iterator>
#include <map>
#include <span>

#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3;

std::vector<dvec3> normalsOf(const BaseSurface& surface) {
    std::vector<dvec3> normals(surface.positions.size(), dvec3(0));
    for (const auto& t : surface.triangles) {
        const dvec3 a = surface.positions[t[0]];
        const dvec3 normal = glm::cross(surface.positions[t[1]] - a, surface.positions[t[2]] - a);
        for (const uint32_t corner : t) normals[corner] += normal;
    }
    for (dvec3& normal : normals) {
        const double length = glm::length(normal);
        normal = length > 0 ? normal / length : dvec3(0, 0, 1);
    }
    return normals;
}

/// An output in pieces of a megabyte.
class TextOut {
public:
    explicit TextOut(OutputFile& file) : file_(file) {}
    template <class... Values>
    Result<void> add(fmt::format_string<const Values&...> format, const Values&... values) {
        fmt::format_to(std::back_inserter(text_), format, values...);
        return text_.size() < (size_t{1} << 20) ? Result<void>() : flush();
    }
    Result<void> flush() {
        VCP_TRY(file_.append(std::as_bytes(std::span(text_.data(), text_.size()))));
        text_.clear();
        return {};
    }

private:
    OutputFile& file_;
    fmt::memory_buffer text_;
};

/// Writes each different pair of coordinates once; returns the numbers of the triangles' corners, from 1.
Result<std::vector<std::array<size_t, 3>>> writeMap(const BaseSurface& surface, TextOut& out) {
    std::map<std::pair<double, double>, size_t> numbers;
    std::vector<std::array<size_t, 3>> corners;
    for (const auto& map : surface.uvs) {
        auto& of = corners.emplace_back();
        for (int k = 0; k < 3; ++k) {
            const auto [at, isNew] = numbers.try_emplace({map[k].x, map[k].y}, numbers.size() + 1);
            if (isNew) VCP_TRY(out.add("vt {} {}\n", map[k].x, map[k].y));
            of[k] = at->second;
        }
    }
    return corners;
}

}  // namespace

Result<void> writeBase(const std::filesystem::path& output, const BaseSurface& surface, const OutputRules& rules) {
    VCP_TRY_ASSIGN(auto file, OutputFile::create(output, OutputKind::Obj, rules));
    TextOut out(file);
    VCP_TRY(out.add("# a base surface by vcp\n"));
    for (const dvec3 p : surface.positions) VCP_TRY(out.add("v {} {} {}\n", p.x, p.y, p.z));
    for (const dvec3 n : normalsOf(surface)) VCP_TRY(out.add("vn {:.6g} {:.6g} {:.6g}\n", n.x, n.y, n.z));
    VCP_TRY_ASSIGN(const auto corners, writeMap(surface, out));
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
        VCP_TRY(out.add("f"));
        for (int k = 0; k < 3; ++k) {
            const uint32_t vertex = surface.triangles[i][k] + 1;
            if (corners.empty())
                VCP_TRY(out.add(" {}//{}", vertex, vertex));
            else
                VCP_TRY(out.add(" {}/{}/{}", vertex, corners[i][k], vertex));
        }
        VCP_TRY(out.add("\n"));
    }
    VCP_TRY(out.flush());
    return file.commit();
}

}  // namespace vcp::meso
