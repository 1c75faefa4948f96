#include "builder/mesh/obj_materials.h"

#include <cmath>
#include <set>

#include <fmt/format.h>

#include "builder/stream/data_uri.h"
#include "builder/stream/number_text.h"

namespace vcp {
namespace {

constexpr size_t kMostWarnings = 100;

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && isSpace(text.front())) text.remove_prefix(1);
    while (!text.empty() && isSpace(text.back())) text.remove_suffix(1);
    return text;
}

}  // namespace

ObjMaterials::ObjMaterials(const std::filesystem::path& path, const MeshOpenOptions& options)
    : file_(path.string()),
      wanted_(options.materials && !path.empty() && path != "-"),
      allowOutside_(options.allowOutside),
      uvs_(options.tempFolder) {
    folder_ = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

void ObjMaterials::addLibrary(std::string_view names) {
    if (!wanted_ || warnings_.size() >= kMostWarnings) return;
    names = trimmed(names);
    if (begun_) {
        warnings_.push_back(
            fmt::format("{}: the material file {} is named too late in the file; it is left out", file_, shown(names)));
        return;
    }
    const auto add = [&](std::string_view name) {
        const auto path = nameBelow(folder_, std::string(name), allowOutside_);
        if (path)
            readMtl(*path, allowOutside_, read_, warnings_, sideFiles_);
        else
            warnings_.push_back(
                fmt::format("{}: the material file {} lies outside its folder, which was not allowed; it is left out",
                            file_, shown(name)));
    };
    // The text is one name with spaces, or several names.
    const auto whole = nameBelow(folder_, std::string(names), allowOutside_);
    if (whole) sideFiles_.emplace_back(*whole);
    std::error_code ignored;
    if (names.find_first_of(" \t") == std::string_view::npos ||
        (whole && std::filesystem::is_regular_file(*whole, ignored)))
        return add(names);
    const char* const end = names.data() + names.size();
    for (const char* p = names.data(); p != end && warnings_.size() < kMostWarnings; p = skipSpaces(p, end)) {
        const char* const stop = wordEnd(p, end);
        add({p, size_t(stop - p)});
        p = stop;
    }
}

void ObjMaterials::begin() {
    begun_ = true;
    std::set<Rgba8> colours;
    for (const MtlMaterial& m : read_) {
        colours.insert(m.material.factor);
        hasImages_ = hasImages_ || m.material.hasImages() || m.material.mask.exists();
        numbers_.try_emplace(m.material.name, uint32_t(materials_.size()));
        materials_.push_back(m.material);
    }
    active_ = hasImages_ || colours.size() > 1;
    if (!active_) materials_.clear();
}

void ObjMaterials::use(std::string_view name) {
    if (!active_) return;
    const auto found = numbers_.find(trimmed(name));
    current_ = found == numbers_.end() ? kNoMaterial : found->second;
    if (found != numbers_.end() || unknownNamed_) return;
    unknownNamed_ = true;
    warnings_.push_back(fmt::format("{}: the material {} is in none of its material files; its faces have no colour",
                                    file_, shown(trimmed(name))));
}

Result<void> ObjMaterials::addUv(double u, double v) { return uvs_.append(glm::vec2(float(u), float(v))); }

Result<void> ObjMaterials::paint(const std::array<std::optional<uint64_t>, 3>& uvs, MeshChunk& chunk) {
    std::array<glm::vec2, 3> corners{};
    const auto where = [&] { return fmt::format("{}: triangle {}", file_, painted_); };
    if (current_ != kNoMaterial && (materials_[current_].hasImages() || materials_[current_].mask.exists())) {
        const MtlMaterial& material = read_[current_];
        for (size_t i = 0; i < 3; ++i) {
            if (!uvs[i]) {
                check_.noteAbsent(where, warnings_);
                continue;
            }
            VCP_TRY_ASSIGN(const auto uv, uvs_.at(*uvs[i]));
            corners[i] = check_.usable(uv, where, warnings_) * material.uvScale + material.uvOffset;
            corners[i].y = 1 - corners[i].y;  // v grows upwards in OBJ
            corners[i] = check_.usable(corners[i], where, warnings_);
        }
    }
    chunk.uvs.push_back(corners);
    chunk.materials.push_back(current_);
    ++painted_;
    return {};
}

}  // namespace vcp
