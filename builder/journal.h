// The journal of a build: what is done, durably, so that an interrupted build goes on where it was.
//
// A file of lines, each a JSON object behind its hash; later ones override the fields of earlier ones. A line
// is appended only after the bytes that it speaks of are durable; a torn last line counts as absent.
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "octree/result.h"

namespace vcp {

class Journal {
public:
    ~Journal();
    Journal() = default;
    Journal(const Journal&) = delete;
    Journal& operator=(const Journal&) = delete;

    /// All fields of the journal in `folder`; null when there is none. Errors: Io.
    static Result<nlohmann::json> read(const std::filesystem::path& folder);

    /// Whether anything was recorded durably by this object.
    [[nodiscard]] bool active() const { return active_; }
    /// Appends to the journal in `folder`, durably. Errors: Io.
    Result<void> record(const std::filesystem::path& folder, const nlohmann::json& fields);

private:
    int file_ = -1;
    bool active_ = false;
};

}  // namespace vcp
