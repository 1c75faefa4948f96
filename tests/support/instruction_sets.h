// Runs tests of the host's rays on every instruction set that this processor has.
#pragma once

#include <set>
#include <string>

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "render/host/host_caster.h"

namespace vcp::test {

/// Runs a test once for each instruction set that the processor has and the caster is compiled for.
template <class Test>
void onEveryInstructionSet(const Test& test) {
    std::set<std::string> done;
    for (int64_t sets = hwy::SupportedTargets(); sets != 0; sets &= sets - 1) {
        hwy::SetSupportedTargetsForTest(sets & -sets);
        if (!done.insert(hostInstructionSet()).second) continue;
        SCOPED_TRACE(hostInstructionSet());
        test();
    }
    hwy::SetSupportedTargetsForTest(0);
}

}  // namespace vcp::test
