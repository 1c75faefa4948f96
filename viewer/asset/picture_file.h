// Files that are decoded as a whole.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "octree/io/result.h"

namespace vcp {

inline constexpr size_t kMostPictureBytes = size_t{1} << 29;

/// Reads a file, or a pipe, of at most 512 MiB. Errors, without file: Io, Limit.
Result<std::vector<std::byte>> readPictureFile(const std::filesystem::path& path);

/// Reads a file and decodes its bytes. Errors: those, and the decoder's, with the file's name.
template <class Picture>
Result<Picture> decodedFile(const std::filesystem::path& path,
                            const std::function<Result<Picture>(std::span<const std::byte>)>& decode) {
    const auto bytes = readPictureFile(path);
    auto picture = bytes ? decode(*bytes) : Result<Picture>(bytes.error());
    if (picture) return picture;
    Error error = picture.error();
    error.file = path.string();
    return error;
}

}  // namespace vcp
