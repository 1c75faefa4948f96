// Writes a PNG file a few rows at a time, for pictures larger than memory.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>

#include "octree/io/output_file.h"
#include "octree/io/result.h"

namespace vcp {

/// For one thread. The file appears with finish(), whole; without it, nothing is left (octree/io/output_file.h).
class PngRows {
public:
    /// Begins a file of 8-bit RGBA, `width` and `height` from 1 to 2^20. Errors: Io, Usage.
    static Result<std::unique_ptr<PngRows>> create(const std::filesystem::path& path, uint32_t width, uint32_t height,
                                                   const OutputRules& rules = {});
    ~PngRows();
    PngRows(const PngRows&) = delete;
    PngRows& operator=(const PngRows&) = delete;

    /// Adds whole rows, from the upper one on: a multiple of 4 * width bytes. Errors: Io; Usage (too many).
    Result<void> add(std::span<const uint8_t> rgba);
    /// Finishes the file. Errors: Io; Usage (rows are missing).
    Result<void> finish();

private:
    struct Encoder;
    explicit PngRows(std::unique_ptr<Encoder> encoder);
    std::unique_ptr<Encoder> encoder_;
};

}  // namespace vcp
