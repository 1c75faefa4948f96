#include "viewer/asset/exr_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#ifdef VCP_HAVE_OPENEXR
#include <Iex.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#endif

namespace vcp {

namespace {

constexpr std::array<uint8_t, 4> kMagic = {0x76, 0x2f, 0x31, 0x01};

Error wrong(ErrorCode code, std::string message) { return {.code = code, .message = std::move(message)}; }

#ifdef VCP_HAVE_OPENEXR

constexpr uint32_t kDeep = 0x800, kSeveralParts = 0x1000;
constexpr size_t kMostAttributes = 4096, kMostChannels = 64;
/// Buffers for a chunk of all channels, or a row of tiles, which the library holds: at most this, or so many pictures.
constexpr uint64_t kBufferBytes = uint64_t{64} << 20, kBufferPictures = 4;
/// Each chunk has an entry in a table, and names its lines and its size.
constexpr uint64_t kLeastChunkBytes = 16;
/// How many bytes of texels a byte of the file may stand for: deflate reaches 1032 at most, of two bytes out of four.
/// Flat DWA has more.
constexpr uint64_t kMostExpansion = 4096, kMostDwaExpansion = 65536;
constexpr uint8_t kDwaa = 8;
/// Lines of a chunk for each compression, by its number.
constexpr std::array<uint32_t, 10> kLinesOfChunk = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};

Error damaged(std::string detail) {
    detail = detail.substr(0, 200);
    for (char& c : detail)
        if (c < ' ' || c > '~') c = ' ';
    // OpenEXR names the stream that it reads, which has no name.
    constexpr std::string_view kNobody = "image file \"\"";
    std::string plain = detail;
    if (const size_t at = plain.find(kNobody); at != std::string::npos)
        plain.replace(at, kNobody.size(), "the picture");
    return wrong(ErrorCode::InvalidInput, "the EXR is damaged: " + plain);
}

/// The attributes that the library needs, and their bytes; those of "channels" vary.
struct Known {
    std::string_view name, type;
    size_t bytes;
};
constexpr Known kKnown[] = {
    {"channels", "chlist", 0},        {"compression", "compression", 1}, {"dataWindow", "box2i", 16},
    {"displayWindow", "box2i", 16},   {"lineOrder", "lineOrder", 1},     {"pixelAspectRatio", "float", 4},
    {"screenWindowCenter", "v2f", 8}, {"screenWindowWidth", "float", 4}, {"tiles", "tiledesc", 9}};

/// Counts the names, with 16 bytes each, before an empty one; nothing where the list has anything else.
std::optional<size_t> countChannels(std::span<const std::byte> list) {
    for (size_t count = 0; !list.empty(); ++count) {
        const auto end = std::find(list.begin(), list.end(), std::byte{0});
        const auto name = size_t(end - list.begin());
        if (name == 0 && list.size() == 1) return count;
        if (name == 0 || list.size() < name + 1 + 16) return std::nullopt;
        list = list.subspan(name + 1 + 16);
    }
    return std::nullopt;
}

/// Reads a header before the library allocates by it. Attributes that the library does not need get a type that it does
/// not know, so that it skips as many bytes as they say.
class HeaderWalk {
public:
    explicit HeaderWalk(std::span<const std::byte> file) : file_(file) {}

    [[nodiscard]] const std::vector<std::byte>& header() const { return header_; }

    Result<glm::ivec2> sizeOf(int mostEdge) {
        uint32_t version = 0;
        at_ = kMagic.size();
        if (!take(&version, sizeof version)) return cut();
        if ((version & (kDeep | kSeveralParts)) != 0)
            return wrong(ErrorCode::Unsupported,
                         "is an EXR of several parts or of deep texels; save it as a plain one");
        for (size_t count = 0; count < kMostAttributes; ++count) {
            const auto name = word();
            if (!name) return cut();
            if (name->empty()) return checked(mostEdge);
            const size_t typeAt = at_;
            const auto type = word();
            uint32_t bytes = 0;
            if (!type || !take(&bytes, sizeof bytes) || bytes > file_.size() - at_) return cut();
            const auto known =
                std::ranges::find_if(kKnown, [&](const Known& k) { return k.name == *name && k.type == *type; });
            if (known == std::end(kKnown))
                masked_.push_back({typeAt, type->size()});
            else
                VCP_TRY(attribute(*known, file_.subspan(at_, bytes)));
            at_ += bytes;
        }
        return damaged("too many attributes");
    }

private:
    static Error cut() { return damaged("it ends within its header"); }

    bool take(void* to, size_t bytes) {
        if (bytes > file_.size() - at_) return false;
        std::memcpy(to, file_.data() + at_, bytes);
        at_ += bytes;
        return true;
    }
    /// Returns a word up to a zero byte; names have 255 letters at most.
    std::optional<std::string_view> word() {
        const auto rest = file_.subspan(at_, std::min<size_t>(256, file_.size() - at_));
        const auto end = std::find(rest.begin(), rest.end(), std::byte{0});
        if (end == rest.end()) return std::nullopt;
        at_ += size_t(end - rest.begin()) + 1;
        return std::string_view(reinterpret_cast<const char*>(rest.data()), size_t(end - rest.begin()));
    }
    Result<void> attribute(const Known& known, std::span<const std::byte> value) {
        // The library joins lists of channels, and takes the last of attributes that come twice.
        if (std::ranges::find(seen_, known.name) != seen_.end())
            return damaged(fmt::format("it has {} twice", known.name));
        seen_.push_back(known.name);
        if (known.bytes > 0 && value.size() != known.bytes)
            return damaged(fmt::format("its {} has another size", known.name));
        if (known.name == "dataWindow") {
            std::memcpy(window_.data(), value.data(), sizeof window_);
            hasWindow_ = true;
        } else if (known.name == "tiles") {
            std::memcpy(tile_.data(), value.data(), sizeof tile_);
            hasTiles_ = true;
        } else if (known.name == "compression") {
            compression_ = uint8_t(value[0]);
        } else if (known.name == "channels") {
            const auto count = countChannels(value);
            if (!count) return damaged("its list of channels");
            if (*count > kMostChannels)
                return wrong(ErrorCode::Limit,
                             fmt::format("an EXR of {} channels; at most {} are read", *count, kMostChannels));
            texelBytes_ = sizeof(float) * std::max<size_t>(*count, 1);
        }
        return {};
    }
    Result<glm::ivec2> checked(int mostEdge) {
        if (!hasWindow_) return damaged("no data window");
        const int64_t width = int64_t{window_[2]} - window_[0] + 1, height = int64_t{window_[3]} - window_[1] + 1;
        if (width < 1 || height < 1) return damaged("a data window without texels");
        if (width > mostEdge || height > mostEdge)
            return wrong(ErrorCode::Limit,
                         fmt::format("{} x {} texels; at most {} an edge are read", width, height, mostEdge));
        VCP_TRY(hasTiles_ ? checkTiles(uint64_t(width), uint64_t(height))
                          : checkLines(uint64_t(width), uint64_t(height)));
        const uint64_t expansion = compression_ >= kDwaa ? kMostDwaExpansion : kMostExpansion;
        if (uint64_t(width * height) * texelBytes_ / expansion > file_.size())
            return damaged(fmt::format("{} bytes cannot hold {} x {} texels", file_.size(), width, height));
        header_.assign(file_.begin(), file_.begin() + std::ptrdiff_t(at_));
        for (const auto& [first, count] : masked_)
            std::fill_n(header_.begin() + std::ptrdiff_t(first), count, std::byte{'?'});
        return glm::ivec2(int(width), int(height));
    }

    Result<void> checkTiles(uint64_t width, uint64_t height) const {
        constexpr uint32_t kMostTileEdge = 65536;
        const uint64_t x = tile_[0], y = tile_[1];
        if (x < 1 || y < 1) return damaged("tiles without texels");
        const uint64_t across = (width + x - 1) / x, down = (height + y - 1) / y;
        if (x > kMostTileEdge || y > kMostTileEdge || !fits(across * x * y, width * height))
            return wrong(
                ErrorCode::Limit,
                fmt::format("an EXR of {} x {} texels in tiles of {} x {}; save it with smaller tiles, or in lines",
                            width, height, x, y));
        return checkChunks(across * down);
    }
    Result<void> checkLines(uint64_t width, uint64_t height) const {
        const uint64_t lines = compression_ < kLinesOfChunk.size() ? kLinesOfChunk[compression_] : kLinesOfChunk.back();
        if (!fits(width * lines, width * height))
            return wrong(
                ErrorCode::Limit,
                fmt::format("an EXR of {} x {} texels of {} bytes, {} lines together; save it with fewer channels",
                            width, height, texelBytes_, lines));
        return checkChunks((height + lines - 1) / lines);
    }
    [[nodiscard]] bool fits(uint64_t bufferTexels, uint64_t texels) const {
        return bufferTexels * texelBytes_ <= std::max(kBufferBytes, kBufferPictures * texels * texelBytes_);
    }
    Result<void> checkChunks(uint64_t chunks) const {
        if (chunks > file_.size() / kLeastChunkBytes)
            return damaged(fmt::format("{} bytes cannot hold {} blocks of texels", file_.size(), chunks));
        return {};
    }

    std::span<const std::byte> file_;
    std::vector<std::byte> header_;
    std::vector<std::pair<size_t, size_t>> masked_;  ///< types that are masked: first byte, bytes
    size_t at_ = 0;
    std::array<int32_t, 4> window_{};
    std::array<uint32_t, 2> tile_{};
    std::vector<std::string_view> seen_;
    uint64_t texelBytes_ = sizeof(float);  ///< bytes of a texel in all channels, as floats
    uint8_t compression_ = 0;
    bool hasWindow_ = false, hasTiles_ = false;
};

/// A file, and what stands for its beginning.
class MemoryStream : public Imf::IStream {
public:
    MemoryStream(std::span<const std::byte> bytes, std::span<const std::byte> header)
        : Imf::IStream(""), bytes_(bytes), header_(header) {}

    bool read(char to[], int count) override {
        if (count < 0 || at_ > bytes_.size() || size_t(count) > bytes_.size() - at_)
            throw Iex::InputExc("it ends too early");
        std::memcpy(to, bytes_.data() + at_, size_t(count));
        if (at_ < header_.size())
            std::memcpy(to, header_.data() + at_, std::min(size_t(count), header_.size() - size_t(at_)));
        at_ += size_t(count);
        return at_ < bytes_.size();
    }
    uint64_t tellg() override { return at_; }
    void seekg(uint64_t to) override { at_ = to; }

private:
    std::span<const std::byte> bytes_, header_;
    uint64_t at_ = 0;
};

/// Returns the channels whose mean is the height; empty where none can be it.
std::vector<std::string> channelsOf(const Imf::ChannelList& list) {
    if (list.findChannel("Y") != nullptr) return {"Y"};
    std::vector<std::string> found;
    for (const char* name : {"R", "G", "B"})
        if (list.findChannel(name) != nullptr) found.emplace_back(name);
    if (!found.empty()) return found;
    for (auto i = list.begin(); i != list.end(); ++i) found.emplace_back(i.name());
    return found.size() == 1 ? found : std::vector<std::string>{};
}

/// Reads channels, all at once; throws what the library throws.
Result<std::vector<std::vector<float>>> planesOf(Imf::InputFile& input, const std::vector<std::string>& names,
                                                 glm::ivec2 size) {
    const Imath::Box2i window = input.header().dataWindow();
    const size_t texel = sizeof(float), row = texel * size_t(size.x);
    std::vector<std::vector<float>> planes;
    Imf::FrameBuffer frame;
    for (const std::string& name : names) {
        const Imf::Channel& channel = *input.header().channels().findChannel(name);
        if (channel.xSampling != 1 || channel.ySampling != 1)
            return wrong(ErrorCode::Unsupported, fmt::format("its channel {} has fewer texels than the picture", name));
        std::vector<float>& plane = planes.emplace_back(size_t(size.x) * size_t(size.y));
        frame.insert(name, Imf::Slice::Make(Imf::FLOAT, plane.data(), window, texel, row));
    }
    input.setFrameBuffer(frame);
    input.readPixels(window.min.y, window.max.y);
    for (const std::vector<float>& plane : planes)
        for (size_t i = 0; i < plane.size(); ++i)
            if (!std::isfinite(plane[i]))
                return Error{.code = ErrorCode::InvalidInput,
                             .message = "is no finite number",
                             .element = fmt::format("texel {}, {}", i % size_t(size.x), i / size_t(size.x))};
    return planes;
}

Result<FloatPicture> meanOf(Imf::InputFile& input, glm::ivec2 size) {
    const auto channels = channelsOf(input.header().channels());
    if (channels.empty()) return wrong(ErrorCode::Unsupported, "has no channel Y, R, G or B, and not just one");
    FloatPicture picture{size, std::vector<float>(size_t(size.x) * size_t(size.y))};
    VCP_TRY_ASSIGN(const auto planes, planesOf(input, channels, size));
    for (const std::vector<float>& plane : planes)
        for (size_t i = 0; i < plane.size(); ++i) picture.values[i] += plane[i] / float(channels.size());
    return picture;
}

Result<FloatColours> coloursOf(Imf::InputFile& input, glm::ivec2 size) {
    const Imf::ChannelList& list = input.header().channels();
    const bool isColoured = list.findChannel("R") && list.findChannel("G") && list.findChannel("B");
    if (!isColoured && !list.findChannel("Y"))
        return wrong(ErrorCode::Unsupported, "has no channels R, G and B, and no Y");
    using Names = std::vector<std::string>;
    VCP_TRY_ASSIGN(auto planes, planesOf(input, isColoured ? Names{"R", "G", "B"} : Names{"Y"}, size));
    planes.resize(3, planes.front());
    return FloatColours{size, {std::move(planes[0]), std::move(planes[1]), std::move(planes[2])}};
}

/// Decodes a picture, what is wanted of it by `pictureOf`, which may throw what the library throws.
template <class Picture>
Result<Picture> decoded(std::span<const std::byte> file, int mostEdge, uint64_t mostTexels,
                        Result<Picture> (*pictureOf)(Imf::InputFile& input, glm::ivec2 size)) {
    if (!isExr(file)) return wrong(ErrorCode::InvalidInput, "is not an EXR");
    HeaderWalk walk(file);
    VCP_TRY_ASSIGN(const auto size, walk.sizeOf(mostEdge));
    if (uint64_t(size.x) * uint64_t(size.y) > mostTexels)
        return wrong(ErrorCode::Limit, fmt::format("{} x {} texels; at most {} are read", size.x, size.y, mostTexels));
    try {
        MemoryStream stream(file, walk.header());
        Imf::InputFile input(stream, 0);
        return pictureOf(input, size);
    } catch (const std::exception& failure) {
        return damaged(failure.what());
    }
}

#endif

}  // namespace

bool isExr(std::span<const std::byte> file) {
    return file.size() >= kMagic.size() && std::memcmp(file.data(), kMagic.data(), kMagic.size()) == 0;
}

#ifdef VCP_HAVE_OPENEXR

bool readsExr() { return true; }

Result<FloatPicture> decodeExr(std::span<const std::byte> file, int mostEdge) {
    return decoded(file, mostEdge, ~uint64_t{0}, meanOf);
}
Result<FloatColours> decodeExrColours(std::span<const std::byte> file, int mostEdge, uint64_t mostTexels) {
    return decoded(file, mostEdge, mostTexels, coloursOf);
}

#else

bool readsExr() { return false; }

Result<FloatPicture> decodeExr(std::span<const std::byte>, int) {
    return wrong(ErrorCode::Unsupported,
                 "is an EXR picture, and this program was built without OpenEXR; save it as a PNG of 16 bits");
}
Result<FloatColours> decodeExrColours(std::span<const std::byte>, int, uint64_t) {
    return wrong(ErrorCode::Unsupported,
                 "is an EXR picture, and this program was built without OpenEXR; save it as a .hdr");
}

#endif

}  // namespace vcp
