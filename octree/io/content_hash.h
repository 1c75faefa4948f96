// The hash that every header, block and page of a file carries.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace vcp {

/// Returns the XXH3-64 of the bytes.
uint64_t hashBytes(std::span<const std::byte> bytes);

}  // namespace vcp
