// Writes a video through ffmpeg, which runs in a process of its own and takes the frames from a pipe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "octree/io/output_file.h"
#include "octree/io/result.h"

namespace vcp {

struct VideoFormat {
    uint32_t width = 0, height = 0;  ///< pixels of each frame, 1 to 16384
    int framesPerSecond = 30;        ///< 1 to 240
};

/// Whether the name says a video that can be written: .mp4 (H.264) or .webm (VP9).
bool isVideoPath(const std::filesystem::path& path);

inline constexpr const char* kNoVideoEncoder =
    "a video needs the program ffmpeg, which is not installed; name a .png for numbered pictures";
/// Whether ffmpeg is installed where programs are looked for.
bool hasVideoEncoder();

/// For one thread. The file appears with finish(), whole; without it, nothing is left (octree/io/output_file.h), and
/// ffmpeg is stopped.
class VideoFile {
public:
    /// Begins a file; an edge of odd length gets one more row or column of black. Errors: Unsupported (no ffmpeg, or a
    /// name that is no video's), Io, Usage.
    static Result<std::unique_ptr<VideoFile>> create(const std::filesystem::path& path, const VideoFormat& format,
                                                     const OutputRules& rules = {});
    ~VideoFile();
    VideoFile(const VideoFile&) = delete;
    VideoFile& operator=(const VideoFile&) = delete;

    /// Adds whole rows, 4 bytes a pixel, RGBA encoded for the screen, alpha ignored: frame after frame, each from its
    /// upper row on. Errors: Io, with what ffmpeg says.
    Result<void> add(std::span<const uint8_t> rgba);
    /// Ends the video with the last frame. Errors: Io.
    Result<void> finish();

private:
    struct Encoder;
    explicit VideoFile(std::unique_ptr<Encoder> encoder);
    std::unique_ptr<Encoder> encoder_;
};

}  // namespace vcp
