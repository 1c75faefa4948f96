// The heights of a map, row by row, x fastest: in main memory, or where they are many in a file
// (octree/io/file_memory.h), of which main memory has what is read. Nobody changes them once they are made; copies
// share them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>

#include "octree/io/file_memory.h"

namespace vcp::meso {

/// Where the heights of a map are kept.
struct HeightStore {
    std::filesystem::path folder = {};          ///< of files; empty: the system's for temporary files
    uint64_t mostInMemory = uint64_t{1} << 22;  ///< heights; a map of more is in a file
};

/// Any thread may call const functions.
class HeightTexels {
public:
    HeightTexels() = default;
    HeightTexels(std::vector<uint16_t> heights)
        : HeightTexels(std::make_shared<std::vector<uint16_t>>(std::move(heights))) {}
    HeightTexels(std::initializer_list<uint16_t> heights) : HeightTexels(std::vector<uint16_t>(heights)) {}
    /// `heights`: among the file's bytes.
    HeightTexels(std::shared_ptr<const FileMemory> file, std::span<const uint16_t> heights)
        : heights_(heights), file_(file.get()), owner_(std::move(file)) {}

    [[nodiscard]] const uint16_t* data() const { return heights_.data(); }
    [[nodiscard]] size_t size() const { return heights_.size(); }
    [[nodiscard]] const uint16_t& operator[](size_t i) const { return heights_[i]; }
    [[nodiscard]] auto begin() const { return heights_.begin(); }
    [[nodiscard]] auto end() const { return heights_.end(); }
    friend bool operator==(const HeightTexels& a, const HeightTexels& b);

    [[nodiscard]] bool areInFile() const { return file_ != nullptr; }
    /// Takes what was read of a file out of main memory.
    void letGo() const {
        if (file_ != nullptr) file_->letGo();
    }

private:
    explicit HeightTexels(std::shared_ptr<const std::vector<uint16_t>> heights)
        : heights_(*heights), owner_(std::move(heights)) {}

    std::span<const uint16_t> heights_;
    const FileMemory* file_ = nullptr;
    std::shared_ptr<const void> owner_;
};

/// Heights while they are made, a row at a time in any order.
class HeightRows {
public:
    /// `size`: texels, at least one. Errors: Io.
    static Result<HeightRows> create(glm::ivec2 size, const HeightStore& store);
    /// Takes the heights of a row. Errors: Io.
    Result<void> write(int row, std::span<const uint16_t> heights);
    [[nodiscard]] HeightTexels take() &&;

private:
    HeightRows() = default;

    std::vector<uint16_t> inMemory_;
    std::shared_ptr<FileMemory> file_;  // null: they are in main memory
};

}  // namespace vcp::meso
