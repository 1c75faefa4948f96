// UvArray: texture coordinates by number, appended one after another and looked up in any order, in bounded
// memory: what is beyond 32 MiB lies in a temporary file, behind a cache of as much.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/stream/random_bytes.h"
#include "octree/io/result.h"

namespace vcp {

class UvArray {
public:
    static constexpr size_t kBlock = 8192;  ///< coordinates read at once

    /// `memoryBlocks`: blocks kept in memory. `folder` as for Spool.
    explicit UvArray(std::filesystem::path folder, size_t memoryBlocks = 512)
        : spool_(std::move(folder), memoryBlocks * kBlock * sizeof(glm::vec2)), slots_(memoryBlocks) {}

    [[nodiscard]] uint64_t size() const { return size_; }

    /// Appends coordinates. Errors: Io.
    Result<void> append(glm::vec2 uv);

    /// Returns coordinates by number. Precondition: number < size(). Errors: Io.
    Result<glm::vec2> at(uint64_t number);

private:
    struct Slot {
        uint64_t block = ~uint64_t{0};
        std::vector<glm::vec2> items;
    };

    Spool spool_;                  // whole blocks
    std::vector<glm::vec2> tail_;  // the last block, until it is whole
    std::vector<Slot> slots_;      // block b is cached in slot b % slots
    uint64_t size_ = 0;
};

}  // namespace vcp
