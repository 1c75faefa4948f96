// Draws pictures into files, tile by tile: one, or a numbered sequence. `vcp render` and the window use it.
//
// Each file is written beside its name and renamed when it is whole: a sequence that ends early leaves the pictures
// that were finished, and nothing else.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "octree/io/result.h"
#include "render/picture_renderer.h"
#include "viewer/picture/png_rows.h"
#include "viewer/picture/tiled_picture.h"
#include "viewer/picture/video_file.h"

namespace vcp {

struct PictureFiles {
    std::filesystem::path picture;         ///< .png; or .mp4 or .webm, a video of all pictures (video_file.h)
    std::filesystem::path depth, normals;  ///< .pfm or .png (image_files.h); empty: not written
};

struct PictureSequenceOptions {
    FrameRequest request;         ///< request of each picture, without the camera
    std::vector<Camera> cameras;  ///< one for each picture; at least one
    /// FrameRequest::surfacesMoved of each picture, in place of the request's; or none.
    std::vector<std::vector<glm::dvec3>> surfacesMoved = {};
    PictureFiles files;
    bool isNumbered = false;  ///< turn.png stands for turn-0001.png and so on; a video has no number
    int framesPerSecond = 30;
    uint32_t tile = 2048;    ///< edge in pixels, at least 16
    uint32_t samples = 1;    ///< of a pixel
    OutputRules rules = {};  ///< what the files may replace
    /// Called with rows of each picture before they are written, to paint over them: the picture's number in `cameras`,
    /// its rows, over its whole width, and the number of the first. May be empty.
    std::function<void(size_t picture, Picture& rows, uint32_t firstRow)> paintOver = {};
    /// Called as those of TiledPictureOptions are.
    std::function<void(const Error& problem)> problem = {};
    std::function<bool()> cancel = {};
};

/// Returns "turn-0007.png" for "turn.png" and 7.
std::filesystem::path numbered(const std::filesystem::path& path, size_t number);

/// Pictures in the making; a picture without its last step leaves nothing. Rows are written as they are drawn; depth
/// and normals are kept until their picture is whole, 4 and 12 bytes a pixel. Used by one thread.
class PictureSequence {
public:
    PictureSequence(PictureRenderer& renderer, PictureSequenceOptions options)
        : renderer_(&renderer), o_(std::move(options)) {}
    PictureSequence(const PictureSequence&) = delete;
    PictureSequence& operator=(const PictureSequence&) = delete;

    /// Draws the next tile or a sample of it where all that it wants is there; never waits for reads. Returns true when
    /// the last file is written. Errors: those of TiledPicture, PngRows, VideoFile, writeDepth and writeNormals; after
    /// one, it must not be called again.
    Result<bool> step();
    /// Whether pages were missing in the last step().
    [[nodiscard]] bool isWaiting() const { return picture_ && picture_->isWaiting(); }
    /// The fraction of the whole sequence, 0 to 1.
    [[nodiscard]] double fraction() const;
    /// The number of pictures whose files are written.
    [[nodiscard]] size_t finished() const { return finished_; }
    [[nodiscard]] size_t pictures() const { return o_.cameras.size(); }
    /// Statistics of all finished pictures together.
    [[nodiscard]] const TiledPictureStats& stats() const { return stats_; }

private:
    [[nodiscard]] std::filesystem::path fileOf(const std::filesystem::path& path) const {
        return o_.isNumbered ? numbered(path, finished_ + 1) : path;
    }
    Result<void> begin();
    Result<void> take(PictureBand& band);
    Result<void> finish();

    PictureRenderer* renderer_;
    PictureSequenceOptions o_;
    size_t finished_ = 0;
    TiledPictureStats stats_;
    // The parts of the picture in the making.
    std::unique_ptr<TiledPicture> picture_;
    std::unique_ptr<PngRows> png_;      // null where a video is made
    std::unique_ptr<VideoFile> video_;  // of all pictures
    uint32_t rows_ = 0;                 // that are written
    std::vector<float> depth_;
    std::vector<glm::vec3> normals_;
};

}  // namespace vcp
