#include "viewer/picture/picture_sequence.h"

#include <algorithm>

#include <fmt/format.h>

#include "viewer/picture/image_files.h"

namespace vcp {

std::filesystem::path numbered(const std::filesystem::path& path, size_t number) {
    return path.parent_path() / fmt::format("{}-{:04}{}", path.stem().string(), number, path.extension().string());
}

double PictureSequence::fraction() const {
    const double begun = picture_ ? picture_->fraction() : 0;
    return (double(finished_) + begun) / double(o_.cameras.size());
}

Result<bool> PictureSequence::step() {
    if (finished_ == o_.cameras.size()) return true;
    if (!picture_) VCP_TRY(begin());
    const auto drawn = picture_->step();
    if (!drawn || !*drawn) return drawn;
    VCP_TRY(finish());
    return finished_ == o_.cameras.size();
}

Result<void> PictureSequence::begin() {
    FrameRequest request = o_.request;
    request.camera = o_.cameras[finished_];
    if (!o_.surfacesMoved.empty()) request.surfacesMoved = o_.surfacesMoved[finished_];
    if (!isVideoPath(o_.files.picture)) {
        VCP_TRY_ASSIGN(png_, PngRows::create(fileOf(o_.files.picture), request.width, request.height, o_.rules));
    } else if (!video_) {
        const VideoFormat format{request.width, request.height, o_.framesPerSecond};
        VCP_TRY_ASSIGN(video_, VideoFile::create(o_.files.picture, format, o_.rules));
    }
    const TiledPictureOptions options{.tile = o_.tile,
                                      .samples = o_.samples,
                                      .depth = !o_.files.depth.empty(),
                                      .normals = !o_.files.normals.empty(),
                                      .problem = o_.problem,
                                      .cancel = o_.cancel};
    picture_ =
        std::make_unique<TiledPicture>(*renderer_, request, options, [this](PictureBand& band) { return take(band); });
    rows_ = 0;
    return {};
}

Result<void> PictureSequence::take(PictureBand& band) {
    if (o_.paintOver) o_.paintOver(finished_, band.picture, rows_);
    rows_ += band.picture.height;
    depth_.insert(depth_.end(), band.depth.begin(), band.depth.end());
    normals_.insert(normals_.end(), band.normals.begin(), band.normals.end());
    return video_ ? video_->add(band.picture.rgba) : png_->add(band.picture.rgba);
}

Result<void> PictureSequence::finish() {
    const auto [width, height] = std::pair(o_.request.width, o_.request.height);
    if (!o_.files.depth.empty()) VCP_TRY(writeDepth(depth_, width, height, fileOf(o_.files.depth), o_.rules));
    if (!o_.files.normals.empty()) VCP_TRY(writeNormals(normals_, width, height, fileOf(o_.files.normals), o_.rules));
    if (png_) VCP_TRY(png_->finish());
    if (video_ && finished_ + 1 == o_.cameras.size()) VCP_TRY(video_->finish());
    const TiledPictureStats& drawn = picture_->stats();
    stats_.tiles += drawn.tiles;
    stats_.rays += drawn.rays;
    stats_.hitPixels += drawn.hitPixels;
    stats_.ms += drawn.ms;
    stats_.errorPixels = std::max(stats_.errorPixels, drawn.errorPixels);
    stats_.colourPixels = std::max(stats_.colourPixels, drawn.colourPixels);
    stats_.remeshedPixels = std::max(stats_.remeshedPixels, drawn.remeshedPixels);
    stats_.uncertifiedPatches = std::max(stats_.uncertifiedPatches, drawn.uncertifiedPatches);
    stats_.missingHeights = std::max(stats_.missingHeights, drawn.missingHeights);
    stats_.update = drawn.update;
    stats_.onHost = drawn.onHost;
    depth_.clear();
    normals_.clear();
    picture_.reset();
    png_.reset();
    ++finished_;
    return {};
}

}  // namespace vcp
