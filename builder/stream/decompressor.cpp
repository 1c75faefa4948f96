#include <algorithm>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <zlib.h>
#include <zstd.h>

#include "builder/stream/byte_input.h"

namespace vcp {
namespace {

constexpr size_t kInputBytes = 64 * 1024;
constexpr int kLargestWindowLog = 27;  // zstd's largest window: 128 MiB
constexpr uint64_t kMostRatio = 2000;
constexpr uint64_t kFreeBytes = 256u << 20;  // any ratio up to here

// The state that both decompressors share: the compressed bytes at hand, and the limit on what they may become.
class Decompressor : public ByteInput {
public:
    Decompressor(std::unique_ptr<ByteInput> inner, std::string start)
        : inner_(std::move(inner)), buffer_(std::max(kInputBytes, start.size())), filled_(start.size()) {
        std::memcpy(buffer_.data(), start.data(), start.size());
    }

    [[nodiscard]] uint64_t taken() const override { return inner_->taken(); }

    Result<size_t> read(char* to, size_t capacity) final {
        if (ended_) return size_t{0};
        const auto made = decompress(to, capacity);
        if (!made) return made;
        made_ += *made;
        if (made_ > kFreeBytes && made_ / kMostRatio > taken())
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("decompresses to more than {} times its size; decompress it first if "
                                                "that is meant",
                                                kMostRatio)};
        ended_ = *made == 0;
        return made;
    }

protected:
    virtual Result<size_t> decompress(char* to, size_t capacity) = 0;

    [[nodiscard]] std::string_view input() const { return {buffer_.data() + used_, filled_ - used_}; }
    void use(size_t bytes) { used_ += bytes; }

    /// Reads more compressed bytes when none are left; returns false at their end.
    Result<bool> refill() {
        if (used_ < filled_) return true;
        VCP_TRY_ASSIGN(const auto got, inner_->read(buffer_.data(), buffer_.size()));
        used_ = 0;
        filled_ = got;
        return filled_ > 0;
    }

    /// Between two members, skips zero bytes, which some archives end with. Returns false at the end of the input.
    Result<bool> toNextMember() {
        while (true) {
            auto more = refill();
            if (!more || !*more) return more;
            used_ = std::min(filled_, used_ + std::min(input().find_first_not_of('\0'), input().size()));
            if (used_ < filled_) return true;
        }
    }

    static Error damaged(std::string_view what, std::string_view detail) {
        return {.code = ErrorCode::InvalidInput, .message = fmt::format("the {} data are damaged ({})", what, detail)};
    }

    static Error truncated(std::string_view what) {
        return {.code = ErrorCode::InvalidInput,
                .message = fmt::format("the {} data end early; the file is truncated", what)};
    }

private:
    std::unique_ptr<ByteInput> inner_;
    std::vector<char> buffer_;
    size_t used_ = 0;
    size_t filled_ = 0;
    uint64_t made_ = 0;
    bool ended_ = false;
};

class GzipInput final : public Decompressor {
public:
    using Decompressor::Decompressor;
    ~GzipInput() override {
        if (open_) ::inflateEnd(&state_);
    }

private:
    Result<size_t> decompress(char* to, size_t capacity) override {
        constexpr int kGzipOnly = 16 + MAX_WBITS;
        if (!open_ && ::inflateInit2(&state_, kGzipOnly) != Z_OK)
            return Error{.code = ErrorCode::Limit, .message = "not enough memory to decompress"};
        open_ = true;
        state_.next_out = reinterpret_cast<Bytef*>(to);
        state_.avail_out = uInt(std::min<size_t>(capacity, 1u << 30));
        const uInt room = state_.avail_out;
        while (state_.avail_out == room) {
            VCP_TRY_ASSIGN(const auto more, inMember_ ? refill() : toNextMember());
            if (!more && !inMember_) return size_t{0};
            if (!more) return truncated("gzip");
            inMember_ = true;
            state_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(input().data()));
            state_.avail_in = uInt(input().size());
            const int status = ::inflate(&state_, Z_NO_FLUSH);
            use(input().size() - state_.avail_in);
            if (status == Z_STREAM_END) {
                inMember_ = false;
                ::inflateReset(&state_);
            } else if (status != Z_OK && status != Z_BUF_ERROR) {
                return damaged("gzip", state_.msg ? state_.msg : "error");
            }
        }
        return size_t{room - state_.avail_out};
    }

    z_stream state_{};
    bool open_ = false;
    bool inMember_ = false;
};

class ZstdInput final : public Decompressor {
public:
    using Decompressor::Decompressor;
    ~ZstdInput() override { ::ZSTD_freeDCtx(state_); }

private:
    Result<size_t> decompress(char* to, size_t capacity) override {
        if (!state_) state_ = ::ZSTD_createDCtx();
        if (!state_) return Error{.code = ErrorCode::Limit, .message = "not enough memory to decompress"};
        ::ZSTD_DCtx_setParameter(state_, ZSTD_d_windowLogMax, kLargestWindowLog);
        ZSTD_outBuffer out{to, capacity, 0};
        while (out.pos == 0) {
            VCP_TRY_ASSIGN(const auto more, inFrame_ ? refill() : toNextMember());
            if (!more && !inFrame_) return size_t{0};
            ZSTD_inBuffer in{input().data(), input().size(), 0};
            const size_t left = ::ZSTD_decompressStream(state_, &out, &in);
            if (::ZSTD_isError(left)) return damaged("zstd", ::ZSTD_getErrorName(left));
            if (!more && out.pos == 0 && left != 0) return truncated("zstd");
            use(in.pos);
            inFrame_ = left != 0;
        }
        return out.pos;
    }

    ZSTD_DCtx* state_ = nullptr;
    bool inFrame_ = false;
};

}  // namespace

std::unique_ptr<ByteInput> makeDecompressor(Compression compression, std::unique_ptr<ByteInput> inner,
                                            std::string start) {
    if (compression == Compression::Gzip) return std::make_unique<GzipInput>(std::move(inner), std::move(start));
    return std::make_unique<ZstdInput>(std::move(inner), std::move(start));
}

}  // namespace vcp
