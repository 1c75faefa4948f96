// Small pictures of what was looked at, for the welcome page: PNG files in the cache, named by a hash of what the file
// is remembered as. They may be removed at any time.
#pragma once

#include <filesystem>
#include <string>

#include "octree/io/result.h"
#include "render/picture.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {

constexpr uint32_t kThumbnailWidth = 272, kThumbnailHeight = 170;

/// Returns the middle of what panels leave of a picture, in a thumbnail's shape and size: each pixel is the mean of
/// those that it covers. Precondition: the picture is not empty.
Picture thumbnailOf(const Picture& picture, const PictureMargins& covered);

class Thumbnails {
public:
    static constexpr size_t kMostFiles = 64;

    /// Keeps them in a folder of defaultCacheFolder(). Errors: those of that.
    static Result<Thumbnails> inCache();
    explicit Thumbnails(std::filesystem::path folder) : folder_(std::move(folder)) {}

    /// Keeps the thumbnail of a remembered name; beyond kMostFiles the oldest ones go. Errors: Io.
    Result<void> keep(const std::string& name, const Picture& thumbnail) const;
    /// Reads it. Errors: those of readPng; InvalidInput where it has another size.
    [[nodiscard]] Result<Picture> read(const std::string& name) const;

private:
    [[nodiscard]] std::filesystem::path pathOf(const std::string& name) const;
    std::filesystem::path folder_;
};

}  // namespace vcp
