#include "viewer/picture/png_rows.h"

#include <cerrno>
#include <cstring>
#include <string>

#include <png.h>
#include <unistd.h>

namespace vcp {

namespace {

constexpr uint32_t kLargest = 1 << 20;

}  // namespace

struct PngRows::Encoder {
    explicit Encoder(OutputFile given) : output(std::move(given)) {}

    OutputFile output;
    uint32_t width = 0, height = 0, rows = 0;
    std::FILE* file = nullptr;
    png_structp png = nullptr;
    png_infop info = nullptr;
    std::string complaint;
    int failed = 0;  // errno of the complaint

    [[nodiscard]] Error error(ErrorCode code, const std::string& what) const {
        return {.code = code, .message = what, .file = output.path().string()};
    }
    [[nodiscard]] Error ioError() const {
        // What libpng says of a write that failed is no more than that.
        const bool isWrite = complaint.empty() || complaint == "Write Error";
        return error(ErrorCode::Io, isWrite ? std::string("cannot write: ") + std::strerror(failed ? failed : errno)
                                            : "PNG: " + complaint);
    }

    // libpng leaves by longjmp: nothing with a destructor may live in these three functions.
    bool begin() {
        if (setjmp(png_jmpbuf(png)) != 0) return false;
        png_init_io(png, file);
        png_set_IHDR(png, info, width, height, 8, PNG_COLOR_TYPE_RGBA, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                     PNG_FILTER_TYPE_DEFAULT);
        png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
        // Speed matters more here than the last few percent of size.
        png_set_compression_level(png, 3);
        png_set_filter(png, 0, PNG_FILTER_SUB);
        png_write_info(png, info);
        return true;
    }
    bool write(const uint8_t* row, uint32_t count) {
        if (setjmp(png_jmpbuf(png)) != 0) return false;
        for (uint32_t i = 0; i < count; ++i) png_write_row(png, row + size_t{4} * width * i);
        return true;
    }
    bool end() {
        if (setjmp(png_jmpbuf(png)) != 0) return false;
        png_write_end(png, info);
        return true;
    }
};

PngRows::PngRows(std::unique_ptr<Encoder> encoder) : encoder_(std::move(encoder)) {}

PngRows::~PngRows() {
    Encoder& e = *encoder_;
    if (e.png) png_destroy_write_struct(&e.png, &e.info);
    if (e.file) std::fclose(e.file);
}

Result<std::unique_ptr<PngRows>> PngRows::create(const std::filesystem::path& path, uint32_t width, uint32_t height,
                                                 const OutputRules& rules) {
    if (width < 1 || height < 1 || width > kLargest || height > kLargest)
        return Error{
            .code = ErrorCode::Usage, .message = "a picture has 1 to 2^20 pixels a side", .file = path.string()};
    VCP_TRY_ASSIGN(auto output, OutputFile::create(path, OutputKind::Png, rules));
    std::unique_ptr<PngRows> rows(new PngRows(std::make_unique<Encoder>(std::move(output))));
    Encoder& e = *rows->encoder_;
    e.width = width;
    e.height = height;
    e.file = ::fdopen(::dup(e.output.descriptor()), "wb");
    if (!e.file) return e.ioError();
    e.png = png_create_write_struct(
        PNG_LIBPNG_VER_STRING, &e,
        [](png_structp png, png_const_charp what) {
            auto& encoder = *static_cast<Encoder*>(png_get_error_ptr(png));
            encoder.failed = errno;
            encoder.complaint = what;
            png_longjmp(png, 1);
        },
        [](png_structp, png_const_charp) {});
    e.info = e.png ? png_create_info_struct(e.png) : nullptr;
    if (!e.info) return e.error(ErrorCode::Limit, "no memory for a PNG encoder");
    if (!e.begin()) return e.ioError();
    return rows;
}

Result<void> PngRows::add(std::span<const uint8_t> rgba) {
    Encoder& e = *encoder_;
    const uint64_t rowBytes = uint64_t{4} * e.width, count = rgba.size() / rowBytes;
    if (rgba.size() % rowBytes != 0 || count > e.height - e.rows)
        return e.error(ErrorCode::Usage, "rows that the picture does not have");
    if (!e.write(rgba.data(), uint32_t(count))) return e.ioError();
    e.rows += uint32_t(count);
    return {};
}

Result<void> PngRows::finish() {
    Encoder& e = *encoder_;
    if (e.rows != e.height) return e.error(ErrorCode::Usage, "rows of the picture are missing");
    if (!e.end() || std::fflush(e.file) != 0) return e.ioError();
    return e.output.commit();
}

}  // namespace vcp
