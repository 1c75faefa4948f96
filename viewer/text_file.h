// Small files of text that a person names.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "octree/result.h"

namespace vcp {

/// All of a file, or of a pipe, of at most `most` bytes. `what` it is to be, for errors: "a scene file". `unopened`: what is said of a folder and
/// of what cannot be opened. Errors: Io; Limit.
inline Result<std::string> readText(const std::filesystem::path& path, size_t most, const std::string& what, const std::string& unopened = "cannot be opened") {
    std::error_code failed;
    std::ifstream file(path, std::ios::binary);
    if (!file || std::filesystem::is_directory(path, failed)) return Error{ErrorCode::Io, unopened, path.string()};
    std::string text, block(size_t{1} << 16, '\0');
    while (file.read(block.data(), static_cast<std::streamsize>(block.size())), file.gcount() > 0) {
        text.append(block, 0, static_cast<size_t>(file.gcount()));
        if (text.size() > most) return Error{ErrorCode::Limit, "too large for " + what, path.string()};
    }
    if (file.bad()) return Error{ErrorCode::Io, "cannot be read", path.string()};
    return text;
}

}  // namespace vcp
