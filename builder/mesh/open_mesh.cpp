#include "builder/mesh/open_mesh.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "builder/mesh/gltf/draco.h"
#include "builder/mesh/gltf/gltf.h"
#include "builder/mesh/obj.h"
#include "builder/mesh/off.h"
#include "builder/mesh/ply.h"
#include "builder/mesh/stl.h"
#include "builder/stream/byte_source.h"
#include "builder/stream/number_text.h"

namespace vcp {
namespace {

constexpr size_t kFormatStartBytes = 1024;  // bytes that tell the format
constexpr std::array<std::string_view, 7> kFormats{"ply", "obj", "stl", "off", "gltf", "glb", "drc"};

std::string lower(std::string text) {
    std::ranges::transform(text, text.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
    return text;
}

// Returns "ply" for "a.PLY.gz"; empty when the name says nothing.
std::string formatByName(std::filesystem::path path) {
    std::string extension = lower(path.extension().string());
    if (extension == ".gz" || extension == ".zst") {
        path.replace_extension();
        extension = lower(path.extension().string());
    }
    if (!extension.empty()) extension.erase(0, 1);
    return std::ranges::find(kFormats, extension) == kFormats.end() ? "" : extension;
}

std::string formatByContent(std::string_view start, const ByteSource& source) {
    if (start.starts_with("ply")) return "ply";
    if (looksLikeStl(start, source.sizeKnown() ? std::optional(source.size()) : std::nullopt)) return "stl";
    if (looksLikeDraco(start)) return "drc";
    if (looksLikeGltf(start)) return "gltf";
    if (looksLikeOff(start)) return "off";
    if (looksLikeObj(start)) return "obj";
    return "";
}

Error unknownFormat(const ByteSource& source) {
    return source.error(ErrorCode::Unsupported, "", std::nullopt,
                        "unknown mesh format; known are PLY, OBJ, STL, OFF, glTF, GLB and Draco, also as .gz and .zst");
}

}  // namespace

std::span<const std::string_view> meshFormats() { return kFormats; }

Result<std::unique_ptr<MeshStream>> openMesh(const std::filesystem::path& path, const MeshOpenOptions& options) {
    const std::string wanted = lower(options.format);
    if (!wanted.empty() && std::ranges::find(kFormats, wanted) == kFormats.end())
        return Error{
            .code = ErrorCode::Usage,
            .message = fmt::format("unknown mesh format {}; known are {}", shown(wanted), fmt::join(kFormats, ", "))};
    VCP_TRY_ASSIGN(auto source, ByteSource::open(path));
    VCP_TRY_ASSIGN(const auto window, source.window(kFormatStartBytes));
    if (source.atEnd()) return source.error(ErrorCode::InvalidInput, "", 0, "the file is empty");
    if (window.starts_with("VCP\r\n"))
        return source.error(ErrorCode::Unsupported, "", std::nullopt, "is a .vcp file already, and no mesh");
    std::string format = formatByContent(window.substr(0, kFormatStartBytes), source);
    if (format.empty()) format = wanted;
    if (format.empty()) format = formatByName(path);

    if (format == "ply") return openPly(std::move(source));
    if (format == "stl") return openStl(std::move(source));
    if (format == "drc") return openDraco(std::move(source), options.decoderBytes);
    if (format == "gltf" || format == "glb") return openGltf(std::move(source), path, options);
    if (format == "off") return openOff(std::move(source));
    if (format == "obj") return openObj(std::move(source), path, options);
    return unknownFormat(source);
}

Result<std::vector<std::filesystem::path>> expandInputs(std::span<const std::filesystem::path> paths) {
    namespace fs = std::filesystem;
    std::vector<fs::path> expanded;
    for (const fs::path& path : paths) {
        std::error_code failure;
        if (!fs::is_directory(path, failure)) {
            expanded.push_back(path);  // a missing file fails when it is opened
            continue;
        }
        const auto cannot = [&](const std::error_code& why) {
            return Error{
                .code = ErrorCode::Io, .message = "the folder cannot be read: " + why.message(), .file = path.string()};
        };
        std::vector<fs::path> found;
        fs::directory_iterator entry(path, failure);
        for (; !failure && entry != fs::directory_iterator(); entry.increment(failure)) {
            std::error_code ignored;
            if (entry->is_regular_file(ignored) && !formatByName(entry->path()).empty()) found.push_back(entry->path());
        }
        if (failure) return cannot(failure);
        if (found.empty())
            return Error{.code = ErrorCode::InvalidInput,
                         .message = fmt::format("the folder has no mesh file ({})", fmt::join(kFormats, ", ")),
                         .file = path.string()};
        std::ranges::sort(found);
        expanded.insert(expanded.end(), found.begin(), found.end());
    }
    return expanded;
}

}  // namespace vcp
