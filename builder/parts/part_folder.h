// The folder of a part: new while it is made, read by others when it is complete.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

#include "builder/spill/temp_space.h"
#include "octree/io/result.h"

namespace vcp {

struct PartName {
    std::filesystem::path plan;  ///< folder of the plan
    std::string stage;
    unsigned number = 0;

    [[nodiscard]] std::filesystem::path folder() const;
    /// Returns "STAGE NUMBER", as messages and those who run it name it.
    [[nodiscard]] std::string step() const;
};

/// Whether a part is complete: an empty folder of its name, as schedulers make them, is not.
bool isDone(const PartName& part);

/// A part while it is made, in a folder that no other process uses. Without finish() nothing stays of it.
class NewPart {
public:
    explicit NewPart(PartName part);
    ~NewPart();
    NewPart(const NewPart&) = delete;
    NewPart& operator=(const NewPart&) = delete;

    /// The temporary files of the part; made with the first call, which says what they may hold in memory.
    TempSpace& space(uint64_t memoryBytes);
    /// Records `fields`, durably, and gives the folder its name. All files must be durable. Where another process has
    /// finished the same part meanwhile, this one goes. Errors: Io.
    Result<void> finish(const nlohmann::json& fields);

private:
    Result<void> rename();

    PartName part_;
    std::filesystem::path folder_;
    std::unique_ptr<TempSpace> space_;
    bool isFinished_ = false;
};

/// A part that is done, to read.
struct DonePart {
    std::unique_ptr<TempSpace> space;
    nlohmann::json fields;  ///< what was recorded
};

/// Errors: Usage (it is not done); Io; InvalidInput (its journal is lost).
Result<DonePart> openPart(const PartName& part);

}  // namespace vcp
