#include "viewer/window/file_list.h"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <sstream>
#include <system_error>

#include "viewer/scene/mesh_cache.h"

namespace vcp {

namespace fs = std::filesystem;

namespace {

constexpr const char* kExtensions[] = {".vcp", ".vcps", ".json", ".ply", ".obj",
                                       ".stl", ".off",  ".gltf", ".glb", ".drc"};

std::string lowered(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

}  // namespace

bool holds(const std::string& text, const std::string& words) {
    const std::string all = lowered(text);
    std::istringstream typed(lowered(words));
    return std::all_of(std::istream_iterator<std::string>(typed), {},
                       [&](const std::string& word) { return all.find(word) != std::string::npos; });
}

bool looksOpenable(const std::string& name) {
    std::string plain = lowered(name);
    for (const char* packed : {".gz", ".zst"})
        if (plain.ends_with(packed)) plain.resize(plain.size() - std::string(packed).size());
    return std::any_of(std::begin(kExtensions), std::end(kExtensions),
                       [&](const char* extension) { return plain.ends_with(extension); });
}

void FileList::read(const fs::path& folder) {
    std::error_code failed;
    folder_ = fs::absolute(folder, failed).lexically_normal();
    entries_.clear();
    problem_.clear();
    fs::directory_iterator at(folder_, failed);
    for (; !failed && at != fs::directory_iterator() && entries_.size() < kMostEntries; at.increment(failed)) {
        Entry entry{at->path().filename().string()};
        std::error_code unknown;
        const bool isInShards = isFolderOfShards(at->path());
        entry.isFolder = !isInShards && at->is_directory(unknown);
        if (entry.name.starts_with('.')) continue;
        if (!entry.isFolder && !isInShards) {
            if (!looksOpenable(entry.name)) continue;
            entry.bytes = at->file_size(unknown);
        }
        if (!unknown) entries_.push_back(std::move(entry));
    }
    if (failed) problem_ = failed.message();
    std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
        if (a.isFolder != b.isFolder) return a.isFolder;
        const std::string one = lowered(a.name), other = lowered(b.name);
        return one != other ? one < other : a.name < b.name;
    });
}

std::vector<FileList::Entry> FileList::holding(const std::string& words) const {
    std::vector<Entry> found;
    std::copy_if(entries_.begin(), entries_.end(), std::back_inserter(found),
                 [&](const Entry& entry) { return holds(entry.name, words); });
    return found;
}

}  // namespace vcp
