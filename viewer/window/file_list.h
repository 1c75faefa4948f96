// A folder as the window lists it: folders, and files that can be opened.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vcp {

class FileList {
public:
    static constexpr size_t kMostEntries = 2000;

    struct Entry {
        std::string name;
        bool isFolder = false;  ///< one that is looked into; a dataset in shards is opened as a file is
        uint64_t bytes = 0;     ///< 0 of a dataset in shards
    };

    /// Lists a folder: folders first, each by name, capitals or not; without hidden ones, and at most kMostEntries.
    /// Where it cannot be read, problem() says so, and there are none. Waits for the disk.
    void read(const std::filesystem::path& folder);

    [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
    [[nodiscard]] const std::string& problem() const { return problem_; }
    /// Returns the entries whose names hold all the words.
    [[nodiscard]] std::vector<Entry> holding(const std::string& words) const;

private:
    std::filesystem::path folder_;
    std::vector<Entry> entries_;
    std::string problem_;
};

/// Whether a file's name is one of a dataset, a scene or a mesh.
bool looksOpenable(const std::string& name);

/// Whether a text holds each of some words, which blanks part, in any order, capitals or not (ASCII).
bool holds(const std::string& text, const std::string& words);

}  // namespace vcp
