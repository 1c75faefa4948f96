// The journal of a build records, durably, what is done, so that an interrupted build can be continued.
//
// A file of lines, each a JSON object behind its hash; later ones override the fields of earlier ones. A line
// is appended only after the bytes that it speaks of are durable; a torn or damaged line counts as absent.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "builder/spill/temp_folder.h"
#include "octree/io/result.h"

namespace vcp {

/// Returns text that need not be UTF-8, as names of files, for a journal, and such text from it.
inline nlohmann::json bytesJson(const std::string& text) { return std::vector<uint8_t>(text.begin(), text.end()); }
inline std::string textFromBytes(const nlohmann::json& bytes) {
    const auto all = bytes.get<std::vector<uint8_t>>();
    return {all.begin(), all.end()};
}

class Journal {
public:
    ~Journal();
    Journal() = default;
    Journal(const Journal&) = delete;
    Journal& operator=(const Journal&) = delete;

    /// Returns all fields of the journal in `folder`, which must be held; null when there is none. Errors: Io (it
    /// cannot be read, is a link).
    static Result<nlohmann::json> read(const TempFolder& folder);

    /// Whether anything was recorded durably by this object.
    [[nodiscard]] bool active() const { return active_; }
    /// Appends to the journal in `folder`, which must be held, durably. Errors: Io.
    Result<void> record(const TempFolder& folder, const nlohmann::json& fields);

private:
    Result<void> open(const TempFolder& folder);

    int file_ = -1;
    bool active_ = false;
};

}  // namespace vcp
