// The hash that every header, block and page of a file carries.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace vcp {

/// Returns the XXH3-64 of the bytes.
uint64_t hashBytes(std::span<const std::byte> bytes);

/// The same of bytes that come piece by piece.
class ContentHash {
public:
    ContentHash();
    ~ContentHash();
    ContentHash(ContentHash&&) noexcept;
    void add(std::span<const std::byte> bytes);
    [[nodiscard]] uint64_t value() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace vcp
