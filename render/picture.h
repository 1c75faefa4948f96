// Pictures in memory and as PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "octree/io/output_file.h"
#include "octree/io/result.h"

namespace vcp {

/// 8-bit RGBA, sRGB-encoded, upper row first, no padding: 4 * width * height bytes.
struct Picture {
    uint32_t width = 0, height = 0;
    std::vector<uint8_t> rgba;

    bool operator==(const Picture&) const = default;
};

/// Writes `path` as an OutputFile does: whole or not at all; "-" is standard output.
/// Errors: Io, with the path; Usage, where the sizes disagree.
Result<void> writePng(const Picture& picture, const std::filesystem::path& path, const OutputRules& rules = {});

/// Reads an 8-bit RGBA PNG of at most 2^28 pixels. The file may be hostile. Errors: Io, InvalidInput.
Result<Picture> readPng(const std::filesystem::path& path);

}  // namespace vcp
