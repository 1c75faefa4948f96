#include "viewer/asset/radiance_picture.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "viewer/asset/exr_picture.h"
#include "viewer/asset/picture_file.h"

namespace vcp {

namespace {

constexpr uint32_t kMostEdge = 8192;
constexpr uint64_t kMostTexels = uint64_t{kMostEdge} * kMostEdge / 2;

/// Decodes Radiance's format (Ward 1991, "Real Pixels"): a text header, then texels of three mantissas and a common
/// exponent, row by row, each row as four planes of runs, or as texels with repeats. Libraries for it take what lacks
/// for black.
class HdrReader {
public:
    explicit HdrReader(std::span<const std::byte> file)
        : left_(reinterpret_cast<const char*>(file.data()), file.size()) {}

    Result<RadiancePicture> read() {
        bool isXyz = false;
        for (std::string_view text = line(); !text.empty(); text = line())
            if (text.starts_with("FORMAT=")) isXyz = text.find("xyze") != text.npos;
        if (isXyz) return Error{.code = ErrorCode::Unsupported, .message = "a Radiance picture in XYZ; save it as RGB"};
        VCP_TRY(readSize(line()));
        for (uint32_t y = 0; y < picture_.size.y; ++y)
            if (!readRow())
                return damaged(fmt::format("it ends, or has wrong runs, in row {} of {}", y + 1, picture_.size.y));
        return std::move(picture_);
    }

private:
    static Error damaged(std::string detail) {
        return {.code = ErrorCode::InvalidInput, .message = fmt::format("the picture is damaged: {}", detail)};
    }

    /// Takes a line away from what is left; an empty one at the end.
    std::string_view line() {
        const size_t end = std::min(left_.find('\n'), left_.size());
        const std::string_view text = left_.substr(0, end);
        left_.remove_prefix(std::min(end + 1, left_.size()));
        return text.ends_with('\r') ? text.substr(0, end - 1) : text;
    }

    Result<void> readSize(std::string_view text) {
        const auto number = [&](std::string_view before, uint32_t& value) {
            if (!text.starts_with(before)) return false;
            text.remove_prefix(before.size());
            const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
            text.remove_prefix(size_t(end - text.data()));
            return failed == std::errc() && value > 0;
        };
        if (text.starts_with("+Y ") || text.starts_with("+X ") || text.starts_with("-X ") ||
            text.find(" -X ") != text.npos)
            return Error{.code = ErrorCode::Unsupported,
                         .message = "its first texel is not the upper left one; save it as \"-Y 1024 +X 2048\""};
        if (!number("-Y ", picture_.size.y) || !number(" +X ", picture_.size.x))
            return damaged("its size is not like \"-Y 1024 +X 2048\"");
        if (std::max(picture_.size.x, picture_.size.y) > kMostEdge ||
            uint64_t{picture_.size.x} * picture_.size.y > kMostTexels)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("{} x {} texels; a picture of surroundings has at most {} x {}",
                                                picture_.size.x, picture_.size.y, kMostEdge, kMostEdge / 2)};
        return {};
    }

    std::optional<uint8_t> byte() {
        if (left_.empty()) return std::nullopt;
        const auto value = uint8_t(left_.front());
        left_.remove_prefix(1);
        return value;
    }

    bool readRow() {
        const uint32_t width = picture_.size.x;
        row_.assign(size_t{width} * 4, 0);
        const auto at = [&](size_t i) { return i < left_.size() ? uint8_t(left_[i]) : 255u; };
        const bool isOfPlanes =
            width >= 8 && width < 32768 && at(0) == 2 && at(1) == 2 && at(2) == width >> 8 && at(3) == (width & 255);
        if (isOfPlanes) left_.remove_prefix(4);
        if (!(isOfPlanes ? readPlanes() : readTexels())) return false;
        for (uint32_t x = 0; x < width; ++x) {
            const uint8_t* const texel = row_.data() + size_t{x} * 4;
            // An exponent of 0 is black; mantissas are of 8 bits.
            const float scale = texel[3] == 0 ? 0.0f : std::ldexp(1.0f, int(texel[3]) - 128 - 8);
            picture_.texels.push_back(scale * glm::vec3(texel[0], texel[1], texel[2]));
        }
        return true;
    }

    bool readPlanes() {
        const uint32_t width = picture_.size.x;
        for (uint32_t plane = 0; plane < 4; ++plane)
            for (uint32_t x = 0; x < width;) {
                const auto count = byte();
                if (!count || *count == 0) return false;
                const bool isRun = *count > 128;
                const uint32_t end = x + (isRun ? *count - 128u : *count);
                if (end > width) return false;
                auto value = isRun ? byte() : std::nullopt;
                for (; x < end; ++x) {
                    if (!isRun) value = byte();
                    if (!value) return false;
                    row_[size_t{x} * 4 + plane] = *value;
                }
            }
        return true;
    }

    /// Texels whose mantissas are all 1 repeat the one before; several in a row count in bytes, the lowest first.
    bool readTexels() {
        const uint32_t width = picture_.size.x;
        for (uint32_t x = 0, shift = 0; x < width;) {
            if (left_.size() < 4) return false;
            uint8_t texel[4];
            for (uint8_t& each : texel) each = *byte();
            if (texel[0] != 1 || texel[1] != 1 || texel[2] != 1) {
                std::copy_n(texel, 4, row_.data() + size_t{x++} * 4);
                shift = 0;
                continue;
            }
            if (x == 0 || shift > 16) return false;
            const uint64_t end = x + (uint64_t{texel[3]} << shift);
            if (end > width) return false;
            for (; x < end; ++x) std::copy_n(row_.data() + size_t{x - 1} * 4, 4, row_.data() + size_t{x} * 4);
            shift += 8;
        }
        return true;
    }

    std::string_view left_;
    RadiancePicture picture_;
    std::vector<uint8_t> row_;  // four bytes a texel
};

bool isHdr(std::span<const std::byte> file) {
    return std::string_view(reinterpret_cast<const char*>(file.data()), file.size()).starts_with("#?");
}

}  // namespace

Result<RadiancePicture> decodeRadiance(std::span<const std::byte> file) {
    if (isHdr(file)) return HdrReader(file).read();
    if (!isExr(file))
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "is neither a Radiance picture (.hdr) nor an EXR of the surroundings"};
    VCP_TRY_ASSIGN(const auto colours, decodeExrColours(file, int(kMostEdge), kMostTexels));
    RadiancePicture picture{glm::uvec2(colours.size), {}};
    picture.texels.reserve(colours.planes[0].size());
    for (size_t i = 0; i < colours.planes[0].size(); ++i)
        picture.texels.push_back(
            glm::max(glm::vec3(colours.planes[0][i], colours.planes[1][i], colours.planes[2][i]), glm::vec3(0)));
    return picture;
}

Result<RadiancePicture> readRadiancePicture(const std::filesystem::path& path) {
    return decodedFile<RadiancePicture>(path, decodeRadiance);
}

}  // namespace vcp
