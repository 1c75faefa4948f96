#include "viewer/window/thumbnails.h"

#include <algorithm>
#include <span>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "octree/io/content_hash.h"
#include "viewer/scene/mesh_cache.h"

namespace vcp {

namespace fs = std::filesystem;

Picture thumbnailOf(const Picture& picture, const PictureMargins& covered) {
    // The largest rectangle of the shape in the middle of what is free.
    const double left = std::clamp(covered.left, 0.0, picture.width - 1.0),
                 top = std::clamp(covered.top, 0.0, picture.height - 1.0);
    const double freeWidth = std::max(1.0, picture.width - left - covered.right),
                 freeHeight = std::max(1.0, picture.height - top - covered.bottom);
    const double scale = std::min(freeWidth / kThumbnailWidth, freeHeight / kThumbnailHeight);
    const double x0 = left + 0.5 * (freeWidth - scale * kThumbnailWidth),
                 y0 = top + 0.5 * (freeHeight - scale * kThumbnailHeight);
    Picture small{kThumbnailWidth, kThumbnailHeight,
                  std::vector<uint8_t>(size_t{4} * kThumbnailWidth * kThumbnailHeight)};
    const auto range = [&](double from, uint32_t i, uint32_t size) {
        const auto begin = uint32_t(std::clamp(from + scale * i, 0.0, size - 1.0));
        const auto end = uint32_t(std::clamp(from + scale * (i + 1), begin + 1.0, double(size)));
        return std::pair(begin, end);
    };
    for (uint32_t y = 0; y < kThumbnailHeight; ++y)
        for (uint32_t x = 0; x < kThumbnailWidth; ++x) {
            const auto [fromX, toX] = range(x0, x, picture.width);
            const auto [fromY, toY] = range(y0, y, picture.height);
            uint64_t sums[3] = {0, 0, 0};
            for (uint32_t v = fromY; v < toY; ++v)
                for (uint32_t u = fromX; u < toX; ++u)
                    for (size_t c = 0; c < 3; ++c) sums[c] += picture.rgba[(size_t{v} * picture.width + u) * 4 + c];
            uint8_t* pixel = &small.rgba[(size_t{y} * kThumbnailWidth + x) * 4];
            const uint64_t count = uint64_t{toX - fromX} * (toY - fromY);
            for (size_t c = 0; c < 3; ++c) pixel[c] = uint8_t((sums[c] + count / 2) / count);
            pixel[3] = 255;
        }
    return small;
}

Result<Thumbnails> Thumbnails::inCache() {
    VCP_TRY_ASSIGN(const auto cache, defaultCacheFolder());
    return Thumbnails(cache / "thumbnails");
}

fs::path Thumbnails::pathOf(const std::string& name) const {
    return folder_ / fmt::format("{:016x}.png", hashBytes(std::as_bytes(std::span(name))));
}

Result<void> Thumbnails::keep(const std::string& name, const Picture& thumbnail) const {
    std::error_code failed;
    fs::create_directories(folder_, failed);
    VCP_TRY(writePng(thumbnail, pathOf(name)));
    std::vector<std::pair<fs::file_time_type, fs::path>> files;
    for (fs::directory_iterator at(folder_, failed); !failed && at != fs::directory_iterator(); at.increment(failed)) {
        std::error_code gone;
        const auto time = at->last_write_time(gone);
        if (!gone && at->path().extension() == ".png") files.emplace_back(time, at->path());
    }
    if (files.size() <= kMostFiles) return {};
    std::sort(files.begin(), files.end());
    for (size_t i = 0; i + kMostFiles < files.size(); ++i) fs::remove(files[i].second, failed);
    return {};
}

Result<Picture> Thumbnails::read(const std::string& name) const {
    const fs::path path = pathOf(name);
    VCP_TRY_ASSIGN(auto picture, readPng(path));
    if (picture.width != kThumbnailWidth || picture.height != kThumbnailHeight)
        return Error{
            .code = ErrorCode::InvalidInput, .message = "has another size than thumbnails", .file = path.string()};
    return picture;
}

}  // namespace vcp
