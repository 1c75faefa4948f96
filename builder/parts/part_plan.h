// The plan of a build in parts, as a file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "builder/build.h"
#include "builder/stream/side_file.h"
#include "octree/io/result.h"

namespace vcp {

inline constexpr const char* kPlanName = "plan.json";

/// An input as it was when the build was planned.
struct PlannedInput {
    std::filesystem::path path;
    std::string stamp;  ///< fileStamp
    uint64_t hash = 0;  ///< of all its bytes
    uint64_t bytes = 0;
};

struct PartPlan {
    BuildOptions options;  ///< inputs and output as absolute paths
    unsigned parts = 1;
    std::string program;  ///< programId() of the one that planned
    std::vector<PlannedInput> inputs;
};

/// Names this very program: its version and a hash of its file. Errors: Io.
Result<std::string> programId();

/// Describes the inputs as they are. Reads all of them. Errors: Io.
Result<std::vector<PlannedInput>> describeInputs(const std::vector<std::filesystem::path>& paths);
/// Describes a file that an input names, as it was when it was read; one that is not there has no bytes.
PlannedInput describeSideFile(const SideFile& file);
/// Errors: Usage (the input was changed).
Result<void> checkInput(const PlannedInput& input);

/// Errors: Io, Usage (a name that is not UTF-8).
Result<void> writePlan(const PartPlan& plan, const std::filesystem::path& folder);
/// Errors: Io, InvalidInput (no plan, or a damaged one).
Result<PartPlan> readPlan(const std::filesystem::path& folder);

}  // namespace vcp
