// The part of draco.h that runs in the child process: decodes, and writes what the parent reads.
//
// The child sends a DracoReply first. When its `failed` is 0, `vertices` DracoVertex and then `faces` DracoFace follow.
// Otherwise `messageBytes` of text follow, and `failed` is an ErrorCode plus 1.
#pragma once

#include <cstdint>
#include <type_traits>

#include "builder/mesh/gltf/draco.h"

namespace vcp {

struct DracoReply {
    uint64_t vertices = 0;
    uint64_t faces = 0;
    uint32_t failed = 0;
    uint32_t messageBytes = 0;
    uint32_t hasColour = 0;
    uint32_t hasUv = 0;
    uint32_t hasNormals = 0;
    uint32_t unused = 0;
};

struct DracoVertex {
    double position[3];
    uint32_t colour;
    uint32_t normal;  ///< packDirection
};

struct DracoFace {
    uint32_t vertex[3];
    float uv[3][2];
};

static_assert(std::is_trivially_copyable_v<DracoReply> && sizeof(DracoReply) == 40);
static_assert(sizeof(DracoVertex) == 32 && sizeof(DracoFace) == 36);

/// Decodes what `bytes` gives and writes it to the pipe. Never returns.
[[noreturn]] void runDracoChild(const DracoBytes& bytes, const DracoSelection& selection, int pipe);

}  // namespace vcp
