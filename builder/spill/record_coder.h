// Fixed-size records as fewer bytes, without loss: words as differences to the record before, byte planes, zstd at its
// fastest. Any thread.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace vcp {

/// Appends the records, coded, to `out`. `recordBytes`: a multiple of 4. Returns false, and appends nothing, where that
/// saves nothing.
bool codeRecords(std::span<const std::byte> records, size_t recordBytes, std::vector<std::byte>& out);

/// Decodes records that fill `records`. Returns false where these are not what was coded.
bool decodeRecords(std::span<const std::byte> coded, size_t recordBytes, std::span<std::byte> records);

}  // namespace vcp
