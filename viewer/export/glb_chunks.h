// The frame of a GLB, and numbers as its bytes.
#pragma once

#include <cstdint>
#include <string>

namespace vcp {

/// The headers of the file and of its two chunks take so many bytes.
inline constexpr uint64_t kGlbFrameBytes = 28;

/// Appends a number as its bytes, little endian like the processor's.
template <class Number>
void put(std::string& bytes, Number number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

/// Returns what stands before the `dataBytes` of the binary chunk. Precondition: both are multiples of 4 bytes long,
/// and all is below 2^32 bytes.
inline std::string glbStart(const std::string& json, uint64_t dataBytes) {
    std::string bytes = "glTF";
    put(bytes, uint32_t{2});
    put(bytes, uint32_t(kGlbFrameBytes + json.size() + dataBytes));
    put(bytes, uint32_t(json.size()));
    bytes += "JSON" + json;
    put(bytes, uint32_t(dataBytes));
    return bytes + std::string("BIN\0", 4);
}

}  // namespace vcp
