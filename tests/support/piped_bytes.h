// A pipe without a pipe: bytes whose end is not known beforehand and that arrive a few at a time.
#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

#include "builder/stream/byte_source.h"

namespace vcp::test {

class PipedBytes final : public ByteInput {
public:
    PipedBytes(std::string_view bytes, size_t step) : bytes_(bytes), step_(step) {}

    Result<size_t> read(char* to, size_t capacity) override {
        const size_t count = std::min({capacity, step_, bytes_.size() - taken_});
        if (count > 0) std::memcpy(to, bytes_.data() + taken_, count);
        taken_ += count;
        return count;
    }
    [[nodiscard]] uint64_t taken() const override { return taken_; }

private:
    std::string_view bytes_;
    size_t step_;
    size_t taken_ = 0;
};

/// `bytes` must outlive the source.
inline Result<ByteSource> piped(std::string_view bytes, size_t step, size_t window) {
    return ByteSource::fromInput(std::make_unique<PipedBytes>(bytes, step), std::nullopt, "mesh", window);
}

}  // namespace vcp::test
