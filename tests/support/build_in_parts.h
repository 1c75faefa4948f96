// Builds a dataset in parts, all of them here, one after another.
#pragma once

#include <gtest/gtest.h>

#include "builder/parts/build_parts.h"

namespace vcp::test {

/// Fails fatally where a part does.
inline void buildInParts(const BuildOptions& options, unsigned parts) {
    const auto plan = planParts(options, parts);
    ASSERT_TRUE(plan.ok()) << plan.error().line();
    for (const PartStage& stage : stagesOf(parts))
        for (unsigned i = 0; i < stage.parts; ++i) {
            const auto step = runPart({.folder = *plan, .stage = stage.name, .number = i, .threads = 2});
            ASSERT_TRUE(step.ok()) << step.error().line();
        }
}

}  // namespace vcp::test
