// Structs that C++ and GLSL share: their offsets in C++ against those the compiled shaders carry.
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "render/beam_spirv.h"
#include "render/compose_spirv.h"
#include "render/feedback_spirv.h"
#include "render/frame.h"
#include "render/light_spirv.h"
#include "render/meso_arrays.h"
#include "render/meso_surface_spirv.h"
#include "render/paper_trace_spirv.h"
#include "render/shade_spirv.h"
#include "render/trace_spirv.h"

namespace vcp {
namespace {

/// Offsets of the members of the named struct types of a module.
using Offsets = std::map<std::string, std::vector<uint32_t>>;

Offsets offsetsIn(std::span<const uint32_t> spirv) {
    constexpr uint32_t kOpName = 5, kOpMemberDecorate = 72, kDecorationOffset = 35;
    std::map<uint32_t, std::string> names;
    std::map<uint32_t, std::map<uint32_t, uint32_t>> offsets;
    for (size_t at = 5; at < spirv.size(); at += spirv[at] >> 16) {
        const uint32_t op = spirv[at] & 0xffff;
        if (op == kOpName) names[spirv[at + 1]] = reinterpret_cast<const char*>(&spirv[at + 2]);
        if (op == kOpMemberDecorate && spirv[at + 3] == kDecorationOffset)
            offsets[spirv[at + 1]][spirv[at + 2]] = spirv[at + 4];
    }
    Offsets result;
    for (const auto& [type, members] : offsets)
        for (const auto& [member, offset] : members) result[names[type]].push_back(offset);
    return result;
}

#define OFFSET(member) uint32_t(offsetof(frame::FrameConstants, member))

void expectSameLayout(std::span<const uint32_t> spirv) {
    const Offsets offsets = offsetsIn(spirv);
    ASSERT_TRUE(offsets.contains("FrameConstants"));
    EXPECT_EQ(offsets.at("FrameConstants"), (std::vector<uint32_t>{OFFSET(origin),
                                                                   OFFSET(originX),
                                                                   OFFSET(originY),
                                                                   OFFSET(direction),
                                                                   OFFSET(directionX),
                                                                   OFFSET(directionY),
                                                                   OFFSET(originLattice),
                                                                   OFFSET(latticePerCell),
                                                                   OFFSET(cellPerLattice),
                                                                   OFFSET(feedbackX),
                                                                   OFFSET(feedbackY),
                                                                   OFFSET(width),
                                                                   OFFSET(height),
                                                                   OFFSET(tilesX),
                                                                   OFFSET(tilesY),
                                                                   OFFSET(log2Cells),
                                                                   OFFSET(finestLevel),
                                                                   OFFSET(stripes),
                                                                   OFFSET(shadingMode),
                                                                   OFFSET(lightDirection),
                                                                   OFFSET(upDirection),
                                                                   OFFSET(clay),
                                                                   OFFSET(cap),
                                                                   OFFSET(pixelEdge),
                                                                   OFFSET(pixelEdgePerDepth),
                                                                   OFFSET(occlusionReach),
                                                                   OFFSET(lightLift),
                                                                   OFFSET(lightPlane),
                                                                   OFFSET(sectionCount),
                                                                   OFFSET(occlusionRays),
                                                                   OFFSET(hasShadows),
                                                                   OFFSET(paperEpsilon),
                                                                   OFFSET(worldPerCell),
                                                                   OFFSET(unused0),
                                                                   OFFSET(unused1),
                                                                   OFFSET(rotation),
                                                                   OFFSET(sections)}));
}

TEST(FrameLayout, Mesostructure) {
    const Offsets offsets = offsetsIn(kMesoSurfaceSpirv);
    ASSERT_TRUE(offsets.contains("MesoRecord") && offsets.contains("MesoView"));
    using frame::MesoRecord, frame::MesoView;
    const auto words = [](std::initializer_list<size_t> all) { return std::vector<uint32_t>(all.begin(), all.end()); };
    EXPECT_EQ(offsets.at("MesoRecord"),
              words({offsetof(MesoRecord, extent), offsetof(MesoRecord, cell), offsetof(MesoRecord, cells),
                     offsetof(MesoRecord, fine), offsetof(MesoRecord, ratio), offsetof(MesoRecord, cones),
                     offsetof(MesoRecord, top), offsetof(MesoRecord, at), offsetof(MesoRecord, scale),
                     offsetof(MesoRecord, levels), offsetof(MesoRecord, borders)}));
    EXPECT_EQ(
        offsets.at("MesoView"),
        words({offsetof(MesoView, eye), offsetof(MesoView, eyeX), offsetof(MesoView, eyeY), offsetof(MesoView, forward),
               offsetof(MesoView, forwardX), offsetof(MesoView, forwardY), offsetof(MesoView, picture),
               offsetof(MesoView, light), offsetof(MesoView, colour), offsetof(MesoView, up),
               offsetof(MesoView, colours), offsetof(MesoView, normals), offsetof(MesoView, far)}));
}

TEST(FrameLayout, Light) { expectSameLayout(kLightSpirv); }
TEST(FrameLayout, Beam) { expectSameLayout(kBeamSpirv); }
TEST(FrameLayout, Compose) { expectSameLayout(kComposeSpirv); }
TEST(FrameLayout, PaperTrace) { expectSameLayout(kPaperTraceSpirv); }
TEST(FrameLayout, Feedback) { expectSameLayout(kFeedbackSpirv); }
TEST(FrameLayout, Shade) { expectSameLayout(kShadeSpirv); }
TEST(FrameLayout, Trace) {
    expectSameLayout(kTraceSpirv);
    const Offsets offsets = offsetsIn(kTraceSpirv);
    ASSERT_TRUE(offsets.contains("FrameCounters"));
    EXPECT_EQ(
        offsets.at("FrameCounters"),
        (std::vector<uint32_t>{offsetof(frame::FrameCounters, hitPixels), offsetof(frame::FrameCounters, tracedTiles),
                               offsetof(frame::FrameCounters, steps), offsetof(frame::FrameCounters, fetches)}));
}

}  // namespace
}  // namespace vcp
