// The error of a page whose bytes contradict each other.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "octree/io/result.h"

namespace vcp {

/// `byte`: where in the page what is wrong begins.
inline Error brokenPage(uint64_t byte, std::string what) {
    return {.code = ErrorCode::InvalidInput, .message = std::move(what), .element = "page", .byte = byte};
}

}  // namespace vcp
