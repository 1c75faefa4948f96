#include "builder/mesh_stream.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "builder/byte_source.h"
#include "builder/obj.h"
#include "builder/ply.h"
#include "builder/stl.h"

namespace vcp {
namespace {

constexpr size_t kStartBytes = 1024;

std::string lowerExtension(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    std::ranges::transform(extension, extension.begin(),
                           [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return extension;
}

}  // namespace

Result<std::unique_ptr<MeshStream>> openMesh(const std::filesystem::path& path) {
    auto source = ByteSource::open(path);
    if (!source) return source.error();
    if (source->size() == 0) return source->error(ErrorCode::InvalidInput, "", 0, "the file is empty");
    const auto window = source->window(kStartBytes);
    if (!window) return window.error();
    const std::string_view start = window->substr(0, kStartBytes);
    const std::string extension = lowerExtension(path);

    if (start.starts_with("ply") || extension == ".ply") return openPly(*std::move(source));
    if (looksLikeStl(start, source->size()) || extension == ".stl") return openStl(*std::move(source));
    if (looksLikeObj(start) || extension == ".obj") return openObj(*std::move(source));
    return source->error(ErrorCode::Unsupported, "", std::nullopt,
                         "unknown mesh format; known are PLY, OBJ and STL, ASCII and binary");
}

}  // namespace vcp
