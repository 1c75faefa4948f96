#include "octree/header_check.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include <fmt/format.h>

#include "octree/image/image_tables.h"
#include "octree/io/content_hash.h"

namespace vcp {

namespace {

// No scan has more pages; a count above this is a lie.
constexpr uint64_t kMaxPages = uint64_t{1} << 31;

bool finite(const double* values, int count) {
    return std::all_of(values, values + count, [](double v) { return std::isfinite(v); });
}
bool isLength(double value) { return value >= 0 && std::isfinite(value); }

class HeaderCheck {
public:
    HeaderCheck(const std::string& file, const FileHeader& header, std::span<const std::byte> bytes, uint64_t fileBytes)
        : file_(file), h_(header), bytes_(bytes), fileBytes_(fileBytes), isPaper_(header.method == Method::Paper) {}

    [[nodiscard]] Result<void> run() const {
        VCP_TRY(identity());
        VCP_TRY(method());
        VCP_TRY(sizes());
        VCP_TRY(place());
        VCP_TRY(levelTable());
        VCP_TRY(errors());
        VCP_TRY(counts());
        VCP_TRY(paper());
        VCP_TRY(images());
        return rest();
    }

private:
    [[nodiscard]] Error fail(uint64_t byte, std::string message, ErrorCode code = ErrorCode::InvalidInput) const {
        return {.code = code, .message = std::move(message), .file = file_, .element = "header", .byte = byte};
    }

    /// Checks that it is a .vcp of a known version, and that the file is complete.
    [[nodiscard]] Result<void> identity() const {
        if (std::memcmp(h_.magic, FileHeader{}.magic, sizeof h_.magic) != 0)
            return fail(0, "not a .vcp file; of meshes, vcp build makes one");
        if (!isKnownVersion(h_.version))
            return fail(8,
                        fmt::format("file version {} is not known; this program reads versions {} to {}: {}",
                                    h_.version, kOldestFileVersion, kNewestFileVersion,
                                    h_.version < kNewestFileVersion ? "build it again" : "use a newer program"),
                        ErrorCode::Unsupported);
        std::vector<std::byte> unhashed(bytes_.begin(), bytes_.end());
        std::memset(unhashed.data() + offsetof(FileHeader, hash), 0, 8);
        if (hashBytes(unhashed) != h_.hash)
            return fail(0, "the header's hash does not match: the file was changed or damaged");
        if (h_.headerBytes != kDirectoryOffset) return fail(12, "wrong header size");
        if (h_.fileBytes != fileBytes_)
            return fail(16, fmt::format("the file should have {} bytes, it has {}: it was truncated or appended to",
                                        h_.fileBytes, fileBytes_));
        return {};
    }

    [[nodiscard]] Result<void> method() const {
        if (h_.method != Method::Certified && !isPaper_)
            return fail(140,
                        fmt::format("it was built by method {}, which this program does not know: use a newer program",
                                    uint32_t(h_.method)),
                        ErrorCode::Unsupported);
        if (isPaper_ && h_.flags != 0) return fail(offsetof(FileHeader, flags), "a file of this method has no flags");
        const uint32_t unknown =
            h_.flags & ~(kFlagColour | (h_.version > 3 ? kFlagCovering : 0) | (h_.version > 5 ? kFlagParts : 0) |
                         (h_.version >= kMarkedFileVersion ? kFlagMarks : 0) |
                         (h_.version >= kImagesFileVersion ? kFlagImages : 0) |
                         (h_.version >= kChannelsFileVersion ? kFlagChannels : 0) |
                         (h_.version >= kColourErrorsFileVersion ? kFlagColourErrors : 0) |
                         (h_.version >= kFineSlabsFileVersion ? kFlagFineSlabs : 0));
        if (unknown != 0)
            return fail(offsetof(FileHeader, flags),
                        fmt::format("flags {:#x} are not known to this program: use a newer program", unknown),
                        ErrorCode::Unsupported);
        // Each version above the usual one is of files that have what it is for.
        const auto has = [this](uint32_t flags) { return (h_.flags & flags) == flags; };
        constexpr uint32_t kWithImages = kFlagColour | kFlagParts | kFlagImages;
        const bool isAskedFor = h_.version == kFineSlabsFileVersion      ? has(kFlagCovering | kFlagFineSlabs)
                                : h_.version == kColourErrorsFileVersion ? has(kFlagColour | kFlagColourErrors)
                                : h_.version == kChannelsFileVersion     ? has(kWithImages | kFlagChannels)
                                : h_.version == kImagesFileVersion       ? has(kWithImages)
                                : h_.version == kMarkedFileVersion       ? has(kFlagParts | kFlagMarks)
                                                                         : true;
        if (!isAskedFor) return fail(offsetof(FileHeader, flags), "nothing in the flags asks for this version");
        return {};
    }

    [[nodiscard]] Result<void> images() const {
        if ((h_.flags & kFlagImages) == 0) return {};
        const std::string wrong =
            wrongPlace(h_.images, blockOffset(blocksOf(h_.pages)), h_.fileBytes - sizeof(CommitRecord));
        if (!wrong.empty()) return fail(offsetof(FileHeader, images), wrong);
        if ((h_.images.channels != 0) != ((h_.flags & kFlagChannels) != 0))
            return fail(offsetof(FileHeader, images) + offsetof(ImagesPlace, channels),
                        "the flags disagree with the rows of channels");
        return {};
    }

    [[nodiscard]] Result<void> sizes() const {
        if (h_.levels < 1 || h_.levels > kMaxLevels || h_.log2Cells < 1 ||
            h_.log2Cells > (isPaper_ ? kMaxPaperLog2Cells : 7))
            return fail(128, "levels or page size out of range");
        if (isPaper_ && h_.log2Cells + h_.levels - 1 > kMaxPaperLog2Cells)
            return fail(128, "more levels than a file of this method may have");
        if (h_.pages < 1 || h_.pages > kMaxPages || h_.pages > h_.fileBytes / sizeof(PageEntry))
            return fail(24, "page count out of range");
        return {};
    }

    [[nodiscard]] Result<void> place() const {
        if (!(h_.cell > 0) || !std::isfinite(h_.cell) || !finite(h_.origin, 3) || !finite(h_.boundsMin, 3) ||
            !finite(h_.boundsMax, 3))
            return fail(32, "origin, cell or bounds are not finite");
        const double edge = std::ldexp(h_.cell, int(h_.log2Cells + h_.levels - 1));
        for (int i = 0; i < 3; ++i) {
            if (!std::isfinite(edge) || !std::isfinite(h_.origin[i] + edge))
                return fail(offsetof(FileHeader, cell), "the cell is too large: the root page has no end");
            if (h_.boundsMin[i] > h_.boundsMax[i])
                return fail(offsetof(FileHeader, boundsMin) + 8 * uint64_t(i), "the bounds end before they begin");
        }
        return {};
    }

    [[nodiscard]] Result<void> levelTable() const {
        uint64_t next = 0;
        for (uint32_t l = 0; l < h_.levels; ++l) {
            const LevelRow& row = h_.level[l];
            if (row.firstEntry != next || row.pages < 1 || row.pages > h_.pages - next)
                return fail(byteOf(l), "level table does not add up");
            next += row.pages;
        }
        if (next != h_.pages || h_.level[0].pages != 1) return fail(184, "level table does not add up");
        for (uint32_t l = 1; l < h_.levels; ++l)
            if (h_.level[l].pages > 8 * h_.level[l - 1].pages)
                return fail(byteOf(l) + offsetof(LevelRow, pages),
                            "level table: more pages than the level above has room for");
        return {};
    }

    [[nodiscard]] Result<void> errors() const {
        for (uint32_t l = 0; l < h_.levels; ++l)
            if (!isLength(h_.level[l].certifiedError))
                return fail(byteOf(l) + offsetof(LevelRow, certifiedError),
                            fmt::format("certified error of level {} is not a length", l));
        if (!isLength(h_.errorTarget)) return fail(offsetof(FileHeader, errorTarget), "error target is not a length");
        if (!isLength(h_.certifiedErrorMax))
            return fail(offsetof(FileHeader, certifiedErrorMax), "certified error is not a length");
        if (h_.certifiedErrorMax < h_.level[h_.levels - 1].certifiedError)
            return fail(offsetof(FileHeader, certifiedErrorMax),
                        fmt::format("certified error is {:g}, less than the {:g} in the row of the finest level",
                                    h_.certifiedErrorMax, h_.level[h_.levels - 1].certifiedError));
        return {};
    }

    [[nodiscard]] Result<void> counts() const {
        if (h_.degenerateTriangles > h_.triangles)
            return fail(offsetof(FileHeader, degenerateTriangles), "more triangles without area than triangles");
        if (h_.hardLeaves > h_.leaves) return fail(offsetof(FileHeader, hardLeaves), "more hard leaves than leaves");
        if (h_.closedParts > h_.parts) return fail(offsetof(FileHeader, closedParts), "more closed parts than parts");
        return {};
    }

    [[nodiscard]] Result<void> paper() const {
        if (!isPaper_) return {};
        const PaperParameters& p = h_.paper;
        constexpr uint64_t at = offsetof(FileHeader, paper);
        if (!isLength(p.band)) return fail(at + offsetof(PaperParameters, band), "the method's band is not a length");
        if (!std::isfinite(p.mergeThreshold))
            return fail(at + offsetof(PaperParameters, mergeThreshold), "the method's merge threshold is not a number");
        if (p.growRounds < -1)
            return fail(at + offsetof(PaperParameters, growRounds), "the method's rounds of growing are out of range");
        if (p.packing > uint32_t(PaperPacking::Octahedral))
            return fail(at + offsetof(PaperParameters, packing), "the method's packing is not known");
        if (p.mergeScheme > uint32_t(PaperScheme::Longer))
            return fail(at + offsetof(PaperParameters, mergeScheme), "the method's merge scheme is not known");
        if (p.safeEmpty > 1)
            return fail(at + offsetof(PaperParameters, safeEmpty), "the method's kind of empty nodes is not known");
        return {};
    }

    /// Checks that bytes without a meaning are zero, so that a later version may give them one.
    [[nodiscard]] Result<void> rest() const {
        VCP_TRY(zero(byteOf(h_.levels), offsetof(FileHeader, hash), "rows behind the level table"));
        const bool hasParts = (h_.flags & kFlagParts) != 0, hasImages = (h_.flags & kFlagImages) != 0;
        VCP_TRY(zero(offsetof(FileHeader, paper) + (isPaper_ ? offsetof(PaperParameters, reserved) : 0),
                     hasParts ? offsetof(FileHeader, parts) : kDirectoryOffset, "reserved bytes"));
        return zero(hasImages ? sizeof(FileHeader) : offsetof(FileHeader, images), kDirectoryOffset, "reserved bytes");
    }

    [[nodiscard]] Result<void> zero(uint64_t begin, uint64_t end, const char* what) const {
        for (uint64_t byte = begin; byte < end; ++byte)
            if (bytes_[byte] != std::byte{0}) return fail(byte, fmt::format("{} must be zero", what));
        return {};
    }

    static constexpr uint64_t byteOf(uint64_t level) { return offsetof(FileHeader, level) + level * sizeof(LevelRow); }

    const std::string& file_;
    const FileHeader& h_;
    std::span<const std::byte> bytes_;
    uint64_t fileBytes_;
    bool isPaper_;
};

}  // namespace

Result<void> checkHeader(const std::string& file, const FileHeader& header, std::span<const std::byte> bytes,
                         uint64_t fileBytes) {
    return HeaderCheck(file, header, bytes, fileBytes).run();
}

}  // namespace vcp
