// The structs of render/shared/frame_layout.h in C++.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace vcp::frame {

using uint = uint32_t;
using vec4 = glm::vec4;
using ivec4 = glm::ivec4;
using uvec4 = glm::uvec4;

#include "render/shared/frame_layout.h"

static_assert(sizeof(FrameConstants) == 608 && offsetof(FrameConstants, originLattice) == 96);
static_assert(offsetof(FrameConstants, width) == 128 && offsetof(FrameConstants, clay) == 192);
static_assert(offsetof(FrameConstants, pixelEdge) == 224 && offsetof(FrameConstants, paperEpsilon) == 256);
static_assert(sizeof(FrameCounters) == 4 && sizeof(SceneRay) == 16 && sizeof(TableRecord) == 16 * kRecordTexels);

/// Tells whether two records have the same bytes.
inline bool operator==(const TableRecord& a, const TableRecord& b) { return std::memcmp(&a, &b, sizeof(a)) == 0; }

}  // namespace vcp::frame
