// Structs that C++ and GLSL share: their offsets in C++ against those the compiled shaders carry.
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "render/accumulate_spirv.h"
#include "render/beam_spirv.h"
#include "render/compose_spirv.h"
#include "render/feedback_spirv.h"
#include "render/light_spirv.h"
#include "render/meso_surface_spirv.h"
#include "render/paper_trace_spirv.h"
#include "render/passes/meso_resources.h"
#include "render/scene_light_spirv.h"
#include "render/shade_spirv.h"
#include "render/shared/frame.h"
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
                                                                   OFFSET(hasEnvironment),
                                                                   OFFSET(sampleNumber),
                                                                   OFFSET(partRow),
                                                                   OFFSET(partRows),
                                                                   OFFSET(skippedRows),
                                                                   OFFSET(firstHitMark),
                                                                   OFFSET(rotation),
                                                                   OFFSET(lightCount),
                                                                   OFFSET(opacity),
                                                                   OFFSET(unused0),
                                                                   OFFSET(unused1),
                                                                   OFFSET(moreLights),
                                                                   OFFSET(sections),
                                                                   OFFSET(environment)}));
}

#define AT(type, member) uint32_t(offsetof(type, member))

TEST(FrameLayout, Mesostructure) {
    const Offsets offsets = offsetsIn(kMesoSurfaceSpirv);
    for (const char* type : {"MesoRecord", "MesoLevel", "MesoBorder", "MesoView", "MesoImage", "MesoTransfer"})
        ASSERT_TRUE(offsets.contains(type)) << type;
    using meso::f32::MesoRecord, meso::f32::MesoLevel, meso::f32::MesoBorder, frame::MesoView, frame::MesoImage,
        frame::MesoTransfer;
    using Words = std::vector<uint32_t>;
    EXPECT_EQ(offsets.at("MesoRecord"), (Words{AT(MesoRecord, extent),     AT(MesoRecord, unit),
                                               AT(MesoRecord, cell),       AT(MesoRecord, reach),
                                               AT(MesoRecord, cells),      AT(MesoRecord, cellCount),
                                               AT(MesoRecord, fine),       AT(MesoRecord, mostSteps),
                                               AT(MesoRecord, ratio),      AT(MesoRecord, mostRefinements),
                                               AT(MesoRecord, azimuths),   AT(MesoRecord, elevations),
                                               AT(MesoRecord, levelCount), AT(MesoRecord, columnCount),
                                               AT(MesoRecord, top),        AT(MesoRecord, clusters),
                                               AT(MesoRecord, volume),     AT(MesoRecord, valueBits),
                                               AT(MesoRecord, guessRows),  AT(MesoRecord, guessColumns),
                                               AT(MesoRecord, guesses),    AT(MesoRecord, product),
                                               AT(MesoRecord, skipping),   AT(MesoRecord, data),
                                               AT(MesoRecord, rows),       AT(MesoRecord, patches),
                                               AT(MesoRecord, step),       AT(MesoRecord, height),
                                               AT(MesoRecord, tolerance),  AT(MesoRecord, patchNormals),
                                               AT(MesoRecord, curvatures), AT(MesoRecord, mostCurvature),
                                               AT(MesoRecord, unused0),    AT(MesoRecord, unused1),
                                               AT(MesoRecord, levels),     AT(MesoRecord, borders)}));
    EXPECT_EQ(offsets.at("MesoLevel"), (Words{AT(MesoLevel, first), AT(MesoLevel, entries),
                                              AT(MesoLevel, edgeAndFactor), AT(MesoLevel, unused)}));
    EXPECT_EQ(offsets.at("MesoBorder"), (Words{AT(MesoBorder, azimuth), AT(MesoBorder, elevation)}));
    EXPECT_EQ(offsets.at("MesoView"), (Words{AT(MesoView, eye),          AT(MesoView, eyeX),
                                             AT(MesoView, eyeY),         AT(MesoView, forward),
                                             AT(MesoView, forwardX),     AT(MesoView, forwardY),
                                             AT(MesoView, width),        AT(MesoView, height),
                                             AT(MesoView, nodes),        AT(MesoView, withBase),
                                             AT(MesoView, colour),       AT(MesoView, lightCount),
                                             AT(MesoView, up),           AT(MesoView, shows),
                                             AT(MesoView, colours),      AT(MesoView, normals),
                                             AT(MesoView, strayPixels),  AT(MesoView, meanHeight),
                                             AT(MesoView, farShadows),   AT(MesoView, sectionCount),
                                             AT(MesoView, shadowLift),   AT(MesoView, hasEnvironment),
                                             AT(MesoView, hasBaseLight), AT(MesoView, pieces),
                                             AT(MesoView, lights),       AT(MesoView, sections),
                                             AT(MesoView, environment),  AT(MesoView, transfer),
                                             AT(MesoView, harmonics)}));
    EXPECT_EQ(offsets.at("MesoTransfer"),
              (Words{AT(MesoTransfer, first), AT(MesoTransfer, across), AT(MesoTransfer, back), AT(MesoTransfer, up)}));
    EXPECT_EQ(offsets.at("MesoImage"),
              (Words{AT(MesoImage, first), AT(MesoImage, width), AT(MesoImage, height), AT(MesoImage, levels)}));
}

TEST(FrameLayout, Light) { expectSameLayout(kLightSpirv); }
TEST(FrameLayout, Beam) { expectSameLayout(kBeamSpirv); }
TEST(FrameLayout, Accumulate) { expectSameLayout(kAccumulateSpirv); }
TEST(FrameLayout, Compose) { expectSameLayout(kComposeSpirv); }
TEST(FrameLayout, PaperTrace) { expectSameLayout(kPaperTraceSpirv); }
TEST(FrameLayout, Feedback) { expectSameLayout(kFeedbackSpirv); }
TEST(FrameLayout, SceneLight) { expectSameLayout(kSceneLightSpirv); }
TEST(FrameLayout, Shade) { expectSameLayout(kShadeSpirv); }
TEST(FrameLayout, Trace) {
    expectSameLayout(kTraceSpirv);
    const Offsets offsets = offsetsIn(kTraceSpirv);
    ASSERT_TRUE(offsets.contains("FrameCounters"));
    EXPECT_EQ(offsets.at("FrameCounters"), (std::vector<uint32_t>{offsetof(frame::FrameCounters, hitPixels)}));
}

}  // namespace
}  // namespace vcp
