#include "viewer/picture/image_files.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <csetjmp>
#include <cstring>
#include <vector>

#include <fmt/format.h>
#include <png.h>

namespace vcp {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "PFM is written as the floats lie in memory");

namespace {

std::vector<uint8_t> encodePfm(const float* values, uint32_t channels, uint32_t width, uint32_t height) {
    const std::string head = fmt::format("{}\n{} {}\n-1.0\n", channels == 1 ? "Pf" : "PF", width, height);
    const size_t row = size_t(width) * channels * sizeof(float);
    std::vector<uint8_t> bytes(head.size() + row * height);
    std::memcpy(bytes.data(), head.data(), head.size());
    for (uint32_t y = 0; y < height; ++y)
        std::memcpy(bytes.data() + head.size() + y * row, values + size_t(height - 1 - y) * width * channels, row);
    return bytes;
}

void appendPng(png_structp png, png_bytep data, size_t size) {
    auto* bytes = static_cast<std::vector<uint8_t>*>(png_get_io_ptr(png));
    bytes->insert(bytes->end(), data, data + size);
}

/// Encodes `rows` in the byte order of PNG (16-bit values big endian). Returns nothing when libpng fails (memory).
std::vector<uint8_t> encodePng(const std::vector<uint8_t>& rows, int bits, int colourType, uint32_t width,
                               uint32_t height) {
    std::vector<uint8_t> bytes;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    if (!info || setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, &info);
        return {};
    }
    png_set_write_fn(png, &bytes, appendPng, nullptr);
    png_set_IHDR(png, info, width, height, bits, colourType, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    const size_t stride = rows.size() / height;
    for (uint32_t y = 0; y < height; ++y) png_write_row(png, rows.data() + y * stride);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return bytes;
}

void appendBigEndian(uint32_t value, std::vector<uint8_t>& rows) {
    rows.push_back(uint8_t(value >> 8));
    rows.push_back(uint8_t(value & 255));
}

std::vector<uint8_t> greyRows(std::span<const float> depth) {
    const DepthRange range = depthRange(depth);
    const double scale = range.farthest > range.nearest ? 65534.0 / (double(range.farthest) - range.nearest) : 0;
    std::vector<uint8_t> rows;
    rows.reserve(2 * depth.size());
    for (const float d : depth) {
        appendBigEndian(std::isfinite(d) ? uint32_t(std::lround(1 + scale * (double(d) - range.nearest))) : 0u, rows);
    }
    return rows;
}

std::vector<uint8_t> normalRows(std::span<const glm::vec3> normals) {
    std::vector<uint8_t> rows;
    rows.reserve(3 * normals.size());
    for (const glm::vec3& n : normals)
        for (int axis = 0; axis < 3; ++axis)
            rows.push_back(n == glm::vec3(0) ? uint8_t(0)
                                             : uint8_t(std::lround(128 + 127 * std::clamp(n[axis], -1.0f, 1.0f))));
    return rows;
}

Result<void> writePlane(const std::vector<uint8_t>& bytes, OutputKind kind, const fs::path& path,
                        const OutputRules& rules) {
    if (bytes.empty())
        return Error{
            .code = ErrorCode::Limit, .message = "not enough memory to compress the picture", .file = path.string()};
    return writeFile(path, kind, std::as_bytes(std::span(bytes)), rules);
}

Error unknownKind(const fs::path& path) { return {ErrorCode::Unsupported, "is neither .pfm nor .png", path.string()}; }

}  // namespace

bool isImagePlanePath(const fs::path& path) {
    const auto kind = outputKindOf(path);
    return kind == OutputKind::Pfm || kind == OutputKind::Png;
}

DepthRange depthRange(std::span<const float> depth) {
    DepthRange range{INFINITY, 0};
    for (const float d : depth) {
        if (!std::isfinite(d)) continue;
        range.nearest = std::min(range.nearest, d);
        range.farthest = std::max(range.farthest, d);
    }
    return std::isfinite(range.nearest) ? range : DepthRange{};
}

Result<void> writeDepth(std::span<const float> depth, uint32_t width, uint32_t height, const fs::path& path,
                        const OutputRules& rules) {
    if (!isImagePlanePath(path)) return unknownKind(path);
    const OutputKind kind = *outputKindOf(path);
    return writePlane(kind == OutputKind::Pfm ? encodePfm(depth.data(), 1, width, height)
                                              : encodePng(greyRows(depth), 16, PNG_COLOR_TYPE_GRAY, width, height),
                      kind, path, rules);
}

Result<void> writeGrey16(std::span<const uint16_t> values, uint32_t width, uint32_t height, const fs::path& path,
                         const OutputRules& rules) {
    std::vector<uint8_t> rows;
    rows.reserve(2 * values.size());
    for (const uint16_t value : values) appendBigEndian(value, rows);
    return writePlane(encodePng(rows, 16, PNG_COLOR_TYPE_GRAY, width, height), OutputKind::Png, path, rules);
}

Result<void> writeNormals(std::span<const glm::vec3> normals, uint32_t width, uint32_t height, const fs::path& path,
                          const OutputRules& rules) {
    static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
    if (!isImagePlanePath(path)) return unknownKind(path);
    const OutputKind kind = *outputKindOf(path);
    return writePlane(kind == OutputKind::Pfm ? encodePfm(&normals.data()->x, 3, width, height)
                                              : encodePng(normalRows(normals), 8, PNG_COLOR_TYPE_RGB, width, height),
                      kind, path, rules);
}

}  // namespace vcp
