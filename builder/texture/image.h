// Decodes pictures as mesh files bring them: PNG and JPEG, with limits, as a whole or some rows at a time. Hostile
// bytes are an error, never a crash.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/stream/material.h"
#include "builder/stream/random_bytes.h"
#include "octree/io/result.h"

namespace vcp {

class JpegBlocks;

struct Image {
    uint32_t width = 0;
    uint32_t height = 0;
    std::vector<Rgba8> texels;  ///< row by row from the top
};

struct ImageLimits {
    uint32_t edge = 32768;                 ///< texels along an edge
    uint64_t bytes = uint64_t{512} << 20;  ///< bytes of decoded texels that are held together
    uint64_t fileBytes = uint64_t{2} << 30;
};

/// A picture that is decoded from the top, some rows at a time: PNG (any type, 16 bits cut to 8) or JPEG (grey, RGB;
/// baseline and progressive). What is held is a few rows, but all texels of an interlaced PNG and all blocks of a JPEG
/// of several scans (a progressive one is). One thread at a time.
class ImageRows {
public:
    /// Reads the header. Sizes are checked against the limits and against what as many bytes can hold. Errors, without
    /// file: InvalidInput (damaged), Unsupported (another format, CMYK), Limit (an edge, the bytes of an interlaced
    /// PNG; blocks of more than 256 MiB), Io.
    static Result<std::unique_ptr<ImageRows>> open(std::unique_ptr<RandomBytes> file, const ImageLimits& limits = {});
    virtual ~ImageRows() = default;

    /// Texels along both axes.
    [[nodiscard]] virtual glm::uvec2 size() const = 0;
    /// Returns the most bytes that are held while it is read.
    [[nodiscard]] virtual uint64_t heldBytes() const = 0;
    /// Decodes the next rows into `texels`, a whole number of them. Precondition: as many are left. Errors, without
    /// file: InvalidInput (damaged, truncated), Limit (a JPEG of more than 100 scans), Io; no more can be read then.
    virtual Result<void> read(std::span<Rgba8> texels) = 0;
    /// Returns the blocks of a JPEG once a row was read; nullptr where they cannot be cut into tiles.
    [[nodiscard]] virtual const JpegBlocks* blocks() const { return nullptr; }
};

/// Opens the file that `source` names, or its bytes, which `source` keeps while rows are read. Errors: as
/// ImageRows::open() and Limit (too large a file); with the file's name.
Result<std::unique_ptr<ImageRows>> openImage(const ImageSource& source, const ImageLimits& limits = {});

/// Opens the image of a material; its texels are opaque where its alpha does not count, or was cut out (filled_rows.h).
/// Errors: likewise.
Result<std::unique_ptr<ImageRows>> openImage(const Material& material, const ImageLimits& limits = {});

/// Whether an image may have texels that are not opaque, by the chunks of its file. False where it cannot be read.
bool mayBeTransparent(const ImageSource& source);

/// Decodes a picture as a whole; its texels are limited, too. Errors: as ImageRows'; without file.
Result<Image> decodeImage(std::string_view file, const ImageLimits& limits = {});
/// Decodes the one that `source` names. Errors: as ImageRows' and openImage(); with the file's name.
Result<Image> loadImage(const ImageSource& source, const ImageLimits& limits = {});
/// Decodes that of a material, as openImage() has it. Errors: likewise.
Result<Image> loadImage(const Material& material, const ImageLimits& limits = {});

/// Adds the file's name to an error of a picture.
Error namedImageError(const ImageSource& source, Error error);

}  // namespace vcp
